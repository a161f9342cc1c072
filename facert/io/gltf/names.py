"""Names of morph targets in glTF files, which has no place for them: writers chose several.

``extras.targetNames`` of the mesh is the custom by now. UniVRM wrote it into each primitive, and
before that a name into each target; others name the targets' accessors. In a VRM avatar an
expression that sets a single target names it. Targets without a name are numbered.
"""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from facert.data.arrays import MAX_NAMES
from facert.data.text import listed, printable
from facert.errors import InputError
from facert.io.gltf.document import Document
from facert.io.gltf.vrm import names_of_single_targets

log = logging.getLogger("facert")

_KEYS = ("targetNames", "target_names", "morphTargetNames", "blendShapeNames")
_REST = ("basis", "base", "neutral", "rest")
"""Shape keys that are no targets: some writers name them with the others."""
_NUMBERED = re.compile(r"(buffer|accessor|attribute|position|target|morph|shape|mesh|prim)", re.I)


def target_names(document: Document) -> dict[int, tuple[str, ...]]:
    """The names of the morph targets of each mesh that a node shows, by its number.

    All names of one mesh differ. Where several meshes have targets without names, their numbers
    come with the mesh, so that nobody takes them for the same.

    Raises `InputError` when there are names, and not as many as targets.
    """
    placed = dict.fromkeys(node["mesh"] for node in document.root["nodes"] if "mesh" in node)
    counts = {mesh: _count(document.root["meshes"][mesh]) for mesh in placed}
    counts = {mesh: count for mesh, count in counts.items() if count}
    singles = names_of_single_targets(document.root)
    stated = {m: _stated(document, m, count, singles) for m, count in counts.items()}
    nameless = [mesh for mesh, names in stated.items() if names is None or not all(names)]
    prefixes = dict(zip(nameless, _prefixes(document, nameless), strict=True))
    return {
        mesh: _numbered(names or [""] * counts[mesh], prefixes.get(mesh, ""))
        for mesh, names in stated.items()
    }


def _count(mesh: dict[str, Any]) -> int:
    count = max(len(primitive.get("targets", [])) for primitive in mesh["primitives"])
    if count > MAX_NAMES:
        fix = "Export the face alone."
        raise InputError("targets", f"at most {MAX_NAMES} of a mesh", f"{count}", fix)
    return count


def _stated(
    document: Document, number: int, count: int, singles: dict[tuple[int, int], str]
) -> list[str] | None:
    """The names that a mesh's targets have somewhere, None without any; some may be empty."""
    mesh = document.root["meshes"][number]
    lists = [names for names in _lists(mesh) if any(names)]
    for names in lists:
        if len(names) == count + 1 and names[0].lower() in _REST:
            names = names[1:]
        if len(names) == count and _differ(names):
            return names
    accessors = _names_of_accessors(document, mesh)
    if len(accessors) == count and _differ(accessors) and all(accessors):
        return accessors
    if lists:
        found = f"{len(set(lists[0]))}: {listed(lists[0], 4)}"
        fix = "Export it again, with the names of its shape keys."
        raise InputError(
            f"targetNames of {_label(mesh, number)}", f"{count} different names", found, fix
        )
    expressions = [singles.get((number, index), "") for index in range(count)]
    return expressions if any(expressions) and _differ(expressions) else None


def _lists(mesh: dict[str, Any]) -> Iterator[list[str]]:
    """Iterate over the lists of names in a mesh and its primitives, the customary ones first."""
    for holder in (mesh, *mesh["primitives"]):
        extras = _extras(holder)
        for key in _KEYS:
            if isinstance(extras.get(key), list):
                yield ["" if name is None else str(name) for name in extras[key]]
    for primitive in mesh["primitives"]:
        own = [_own_name(target) for target in primitive.get("targets", [])]
        if any(own):
            yield own


def _own_name(target: dict[str, Any]) -> str:
    """The name in a target itself, as UniVRM began with."""
    extras = _extras(target) | _extras(target, "extra")
    found = extras.get("name", extras.get("targetName", target.get("name", "")))
    return found if isinstance(found, str) else ""


def _extras(holder: dict[str, Any], key: str = "extras") -> dict[str, Any]:
    extras = holder.get(key)
    return extras if isinstance(extras, dict) else {}


def _names_of_accessors(document: Document, mesh: dict[str, Any]) -> list[str]:
    """The names of the positions of a mesh's targets, unless they are but numbered."""
    targets: list[Any] = next((t for one in mesh["primitives"] if (t := one.get("targets"))), [])
    accessors = [document.root["accessors"][one.get("POSITION", 0)] for one in targets]
    names = [str(_extras(one).get("name", one.get("name", ""))) for one in accessors]
    return [] if any(map(_NUMBERED.search, names)) else names


def _differ(names: Sequence[str]) -> bool:
    return max(Counter(filter(None, names)).values(), default=1) == 1


def _label(mesh: dict[str, Any], number: int) -> str:
    name = mesh.get("name")
    return printable(name) if isinstance(name, str) and name else f"mesh{number + 1}"


def _prefixes(document: Document, meshes: Sequence[int]) -> list[str]:
    """What stands before the numbers of targets without names in these meshes, and a warning."""
    if not meshes:
        return []
    labels = [_label(document.root["meshes"][mesh], mesh) for mesh in meshes]
    if len(set(labels)) < len(labels):
        labels = [f"mesh{mesh + 1}" for mesh in meshes]
    prefixes = [f"{label}_" for label in labels] if len(labels) > 1 else [""]
    shown = f"{prefixes[0]}target1, {prefixes[0]}target2, ..."
    log.warning("%s: morph targets without a name are called %s", ", ".join(labels), shown)
    return prefixes


def _numbered(names: Sequence[str], prefix: str) -> tuple[str, ...]:
    """The names, with numbers for empty ones, which no other has."""
    filled = tuple(name or f"{prefix}target{i}" for i, name in enumerate(names, start=1))
    return filled if _differ(filled) else _numbered(names, f"nameless_{prefix}")
