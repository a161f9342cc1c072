"""Expressions of VRM avatars, which are GLB files: sums of morph targets under a name.

VRM 0 has them in ``extensions.VRM.blendShapeMaster.blendShapeGroups``, each with ``binds`` of a
mesh, the index of a target, and a weight from 0 to 100. VRM 1 has them in
``extensions.VRMC_vrm.expressions``, presets and custom ones, each with ``morphTargetBinds`` of a
node, an index, and a weight from 0 to 1. What they do to materials is left aside. A VRM animation
moves a node for each expression: its x is the weight.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray

_FULL = 100.0
_UNKNOWN = "unknown"


@dataclass(frozen=True)
class Bind:
    """A morph target that an expression sets: of a mesh, its index, and its weight."""

    mesh: int
    target: int
    weight: float


def expressions_of(root: dict[str, Any]) -> dict[str, list[Bind]]:
    """The expressions of an avatar that move its mesh, by name; none of another glTF file.

    Those of one name are numbered from the second on.
    """
    extensions = root.get("extensions", {})
    if "VRMC_vrm" in extensions:
        found = _of_version_1(root, extensions["VRMC_vrm"])
    else:
        found = _of_version_0(extensions.get("VRM", {}))
    expressions: dict[str, list[Bind]] = {}
    count: Counter[str] = Counter()
    for name, binds in found:
        if not binds:
            continue
        free = name
        while free in expressions:
            count[name] += 1
            free = f"{name}_{count[name] + 1}"
        expressions[free] = binds
    return expressions


def target_weights(expressions: dict[str, list[Bind]], mesh: int, count: int) -> FloatArray:
    """How far expressions, K of them, set the targets of a mesh, (K, count)."""
    weights = np.zeros((len(expressions), count))
    for row, binds in zip(weights, expressions.values(), strict=True):
        for bind in binds:
            if bind.mesh == mesh:
                row[bind.target] += bind.weight
    return weights


def looks_back(root: dict[str, Any]) -> bool:
    """Whether the avatar looks along -z, as those of VRM 0 do, unlike other glTF files."""
    extensions = root.get("extensions", {})
    return "VRM" in extensions and "VRMC_vrm" not in extensions


def names_of_single_targets(root: dict[str, Any]) -> dict[tuple[int, int], str]:
    """Names of targets, by mesh and index, that are each the whole of an expression."""
    single = {name: b[0] for name, b in expressions_of(root).items() if len(b) == 1}
    return {(b.mesh, b.target): name for name, b in single.items() if b.weight == 1.0}


def animated_expressions(root: dict[str, Any]) -> dict[int, str]:
    """The expressions whose weights a VRM animation holds, by the nodes whose x these are."""
    animation = root.get("extensions", {}).get("VRMC_vrm_animation", {})
    kinds = animation.get("expressions", {})
    found = {kind: kinds.get(kind) or {} for kind in ("preset", "custom")}
    return {one["node"]: name for some in found.values() for name, one in some.items()}


def material_expressions(root: dict[str, Any]) -> tuple[str, ...]:
    """Names of the expressions that do something to materials, which is left aside."""
    extensions = root.get("extensions", {})
    groups = extensions.get("VRM", {}).get("blendShapeMaster", {}).get("blendShapeGroups", [])
    found = [str(one.get("name")) for one in groups if one.get("materialValues")]
    kinds = extensions.get("VRMC_vrm", {}).get("expressions", {})
    for kind in ("preset", "custom"):
        for name, one in (kinds.get(kind) or {}).items():
            if one.get("materialColorBinds") or one.get("textureTransformBinds"):
                found.append(str(name))
    return tuple(found)


def _of_version_0(vrm: dict[str, Any]) -> Iterator[tuple[str, list[Bind]]]:
    for group in vrm.get("blendShapeMaster", {}).get("blendShapeGroups", []):
        preset = str(group.get("presetName") or _UNKNOWN)
        name = str(group.get("name") or preset) if preset == _UNKNOWN else preset
        binds = group.get("binds") or []
        yield name, [Bind(b["mesh"], b["index"], float(b["weight"]) / _FULL) for b in binds]


def _of_version_1(root: dict[str, Any], vrm: dict[str, Any]) -> Iterator[tuple[str, list[Bind]]]:
    kinds = vrm.get("expressions", {})
    for kind in ("preset", "custom"):
        for name, expression in (kinds.get(kind) or {}).items():
            binds = expression.get("morphTargetBinds") or []
            yield name, [_bind(root, bind) for bind in binds]


def _bind(root: dict[str, Any], bind: dict[str, Any]) -> Bind:
    return Bind(root["nodes"][bind["node"]]["mesh"], bind["index"], float(bind["weight"]))
