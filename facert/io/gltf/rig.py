"""Faces in glTF files and VRM avatars: meshes with morph targets as a rig, or at rest.

A character is often cut into several meshes (face, teeth, lashes) whose targets bear the same
names: they become one rig, placed as the scene and its skeleton place them, with all weights at 0.
glTF counts in metres, and y is up.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import Mesh, Rig
from facert.data.text import printable
from facert.errors import InputError
from facert.io.gltf.document import MAX_VALUES, Document, open_gltf
from facert.io.gltf.names import target_names
from facert.io.gltf.scene import Scene, displaced, mirrored, scene_of, transformed
from facert.io.gltf.vrm import Bind, expressions_of, looks_back, target_weights

log = logging.getLogger("facert")

_TRIANGLES = 4
_GAMMA = 2.2
UNITS = "m"
SMALLEST, LARGEST = 0.005, 20.0
"""Metres between which a face is, or the body that it belongs to."""
TARGETS, EXPRESSIONS = "targets", "expressions"
"""What the shapes of a rig are: each morph target alone, or the expressions of a VRM avatar."""


@dataclass(frozen=True, eq=False)
class _Primitive:
    """Triangles in the document: their node and mesh, their entry in it, and its targets."""

    node: int
    mesh: int
    entry: dict[str, Any]
    targets: list[dict[str, Any]]


@dataclass(frozen=True, eq=False)
class _PlacedMesh:
    """Vertices and how morph targets move them, in the space of the scene."""

    vertices: FloatArray  # (V, 3)
    targets: FloatArray  # (K, V, 3)
    names: tuple[str, ...]
    faces: IntArray
    colours: FloatArray | None


def read_gltf_rig(path: Path, shapes: str | None = None) -> Rig:
    """Read all meshes with morph targets as one rig, in metres.

    Targets of the same name belong together. Meshes without a target are left out. Exporters cut a
    vertex in several where texture or normals jump: those that share place and motion are one.
    With `shapes` "expressions", the shapes are the expressions of a VRM avatar.

    Raises `InputError` when the file cannot be read safely, no mesh has morph targets, or there are
    no such shapes.
    """
    with open_gltf(path) as document:
        scene = scene_of(document)
        there = [one for one in _primitives(scene) if one.targets]
        if not there:
            raise InputError(
                "meshes", "morph targets", "none", "Export the mesh with its shape keys."
            )
        names = target_names(document)
        parts = [_part(scene, one, names[one.mesh]) for one in there]
        _log_default_weights(document, there, names)
        expressions = expressions_by_name(document, shapes)
        if shapes == EXPRESSIONS:
            pairs = zip(parts, there, strict=True)
            parts = [_expressed(part, one.mesh, expressions) for part, one in pairs]
        whole = _welded(_united(parts))
        _warn_of_size(whole.vertices)
        return Rig(whole.vertices, whole.targets, whole.names, whole.faces, UNITS, whole.colours)


def read_gltf_mesh(path: Path) -> Mesh:
    """Read the meshes at rest, in metres: those with morph targets, else all; see `read_gltf_rig`.

    Raises `InputError` when the file cannot be read safely, or has no triangles.
    """
    with open_gltf(path) as document:
        scene = scene_of(document)
        there = list(_primitives(scene))
        chosen = [one for one in there if one.targets] or there
        if not chosen:
            raise InputError("meshes", "triangles", "none", "Export the mesh as well.")
        names = target_names(document)
        whole = _welded(_united([_part(scene, one, names.get(one.mesh, ())) for one in chosen]))
        return Mesh(whole.vertices, whole.faces, UNITS, whole.colours)


def _primitives(scene: Scene) -> Iterator[_Primitive]:
    """Iterate over the triangle primitives of the scene."""
    for number in scene.nodes:
        node = scene.document.root["nodes"][number]
        if "mesh" not in node:
            continue
        for one in scene.document.root["meshes"][node["mesh"]]["primitives"]:
            if one.get("mode", _TRIANGLES) == _TRIANGLES:
                yield _Primitive(number, node["mesh"], one, one.get("targets", []))


def _part(scene: Scene, one: _Primitive, names: Sequence[str]) -> _PlacedMesh:
    document, attributes = scene.document, one.entry["attributes"]
    vertices = _vectors(document, attributes["POSITION"])
    _require_moderate(len(one.targets), len(vertices))
    moved = np.zeros((len(one.targets), *vertices.shape))
    for index, target in enumerate(one.targets):
        if "POSITION" in target:
            moved[index] = _vectors(document, target["POSITION"])
    indices = np.arange(len(vertices))
    if "indices" in one.entry:
        indices = document.integers(one.entry["indices"])[:, 0]
    colours = document.numbers(attributes["COLOR_0"])[:, :3] if "COLOR_0" in attributes else None
    placement = scene.placement(one.node, attributes)
    corners = indices.reshape(-1, 3)
    return _PlacedMesh(
        vertices=transformed(vertices, placement),
        targets=displaced(moved, placement),
        names=tuple(names[: len(one.targets)]),
        faces=corners[:, ::-1] if mirrored(placement) else corners,
        colours=colours,
    )


def _warn_of_size(vertices: FloatArray) -> None:
    """Warn of a face that is no face's size in metres: exporters forget their unit."""
    size = float(np.ptp(vertices, axis=0).max())
    if size < SMALLEST or size > LARGEST:  # NaN is refused with the rig
        log.warning(
            "the mesh is %.3g m large, as glTF counts in metres: where its numbers are of another "
            "unit, give that: --in-units cm",
            size,
        )


def _log_default_weights(
    document: Document, there: Sequence[_Primitive], names: dict[int, tuple[str, ...]]
) -> None:
    """Log the weights that the file shows its meshes with, as the neutral is without them."""
    shown: dict[str, float] = {}
    for one in there:
        mesh, node = document.root["meshes"][one.mesh], document.root["nodes"][one.node]
        weights = node.get("weights", mesh.get("weights", []))
        shown |= {name: w for name, w in zip(names[one.mesh], weights, strict=False) if w}
    if shown:
        listed = ", ".join(f"{printable(name)} {weight:g}" for name, weight in shown.items())
        log.info("the file shows the mesh with %s: the neutral is without", printable(listed, 200))


def expressions_by_name(document: Document, shapes: str | None) -> dict[str, list[Bind]]:
    """The expressions of an avatar, which the log lists.

    Raises `InputError` when `shapes` are none of what there is.
    """
    found = expressions_of(document.root)
    choice = (TARGETS, EXPRESSIONS) if found else (TARGETS,)
    if shapes is not None and shapes not in choice:
        expected, fix = f"one of: {', '.join(choice)}", "Choose with --shapes, or leave it out."
        raise InputError("--shapes", expected, repr(shapes), fix)
    if found:
        other = TARGETS if shapes == EXPRESSIONS else EXPRESSIONS
        listed = printable(", ".join(found), 600)
        log.info("expressions: %s; --shapes %s for a rig of those instead", listed, other)
    if looks_back(document.root):
        log.info("an avatar of VRM 0 looks along -z: pictures and pages show it from behind")
    return found


def _expressed(part: _PlacedMesh, mesh: int, expressions: dict[str, list[Bind]]) -> _PlacedMesh:
    """The part with expressions for targets: sums of those that they set."""
    _require_moderate(len(expressions), len(part.vertices))
    weights = target_weights(expressions, mesh, len(part.targets))
    return replace(
        part, targets=np.tensordot(weights, part.targets, axes=1), names=tuple(expressions)
    )


def _united(parts: Sequence[_PlacedMesh]) -> _PlacedMesh:
    """Join parts into one mesh; a target that a part does not have leaves it at rest."""
    names = tuple(dict.fromkeys(name for part in parts for name in part.names))
    sizes = [len(part.vertices) for part in parts]
    _require_moderate(len(names), sum(sizes))
    starts = np.cumsum([0, *sizes[:-1]])
    targets = np.zeros((len(names), sum(sizes), 3))
    for part, start in zip(parts, starts, strict=True):
        rows = [names.index(name) for name in part.names]
        targets[rows, start : start + len(part.vertices)] = part.targets
    return _PlacedMesh(
        vertices=np.concatenate([part.vertices for part in parts]),
        targets=targets,
        names=names,
        faces=np.concatenate([part.faces + n for part, n in zip(parts, starts, strict=True)]),
        colours=_colours(parts),
    )


def _welded(part: _PlacedMesh) -> _PlacedMesh:
    """The part with vertices of equal place and motion made one, in the order of the first ones."""
    motion = part.targets.transpose(1, 0, 2).reshape(len(part.vertices), -1)
    rows = np.concatenate([part.vertices, motion], axis=1)
    _, first, group = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    kept, place = first[order], np.argsort(order)[group.ravel()]
    if len(part.faces) and part.faces.max() >= len(place):
        raise ValueError("triangles of vertices that are not there")
    return replace(
        part,
        vertices=part.vertices[kept],
        targets=part.targets[:, kept],
        faces=place[part.faces],
        colours=None if part.colours is None else part.colours[kept],
    )


def _require_moderate(targets: int, vertices: int) -> None:
    if 3 * max(targets, 1) * vertices > MAX_VALUES:
        found = f"{targets} targets of {vertices} vertices"
        raise InputError("meshes", "a face of moderate size", found, "Export the face alone.")


def _vectors(document: Document, accessor: int) -> FloatArray:
    vectors = document.numbers(accessor)
    if vectors.shape[1] != 3:
        raise ValueError("positions that are no vectors")
    return vectors


def _colours(parts: Sequence[_PlacedMesh]) -> FloatArray | None:
    """Colours (V, 3) as a screen shows them, if all parts have some; glTF's are linear light."""
    colours = [part.colours for part in parts if part.colours is not None]
    if len(colours) < len(parts):
        return None
    return np.asarray(np.clip(np.concatenate(colours), 0, 1) ** (1 / _GAMMA))
