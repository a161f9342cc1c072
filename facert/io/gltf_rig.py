"""Faces in glTF files: meshes with morph targets as a rig, or at rest.

A character is often cut into several meshes (face, teeth, lashes) whose targets bear the same
names: they become one rig, placed as the scene places them. The targets' names are in the
``extras`` of the mesh. glTF counts in metres, and y is up.
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
from facert.errors import InputError
from facert.io.gltf import MAX_VALUES, Document, open_gltf

log = logging.getLogger("facert")

_TRIANGLES = 4
_GAMMA = 2.2
UNITS = "m"


@dataclass(frozen=True, eq=False)
class _Primitive:
    """Triangles in the document: their mesh, its entry of them, where the scene places them."""

    mesh: dict[str, Any]
    entry: dict[str, Any]
    targets: list[dict[str, Any]]
    world: FloatArray  # (4, 4)


@dataclass(frozen=True, eq=False)
class _PlacedMesh:
    """Vertices and how morph targets move them, in the space of the scene."""

    vertices: FloatArray  # (V, 3)
    targets: FloatArray  # (K, V, 3)
    names: tuple[str, ...]
    faces: IntArray
    colours: FloatArray | None


def read_gltf_rig(path: Path) -> Rig:
    """Read all meshes with morph targets as one rig, in metres.

    Targets of the same name belong together. Meshes without a target are left out. Exporters cut a
    vertex in several where texture or normals jump: those that share place and motion are one.

    Raises `InputError` when the file cannot be read safely, or no mesh has morph targets.
    """
    with open_gltf(path) as document:
        parts = [_part(document, one) for one in _primitives(document) if one.targets]
        if not parts:
            raise InputError(
                "meshes", "morph targets", "none", "Export the mesh with its shape keys."
            )
        whole = _welded(_united(parts))
        return Rig(whole.vertices, whole.targets, whole.names, whole.faces, UNITS, whole.colours)


def read_gltf_mesh(path: Path) -> Mesh:
    """Read the meshes at rest, in metres: those with morph targets, else all; see `read_gltf_rig`.

    Raises `InputError` when the file cannot be read safely, or has no triangles.
    """
    with open_gltf(path) as document:
        there = list(_primitives(document))
        chosen = [one for one in there if one.targets] or there
        if not chosen:
            raise InputError("meshes", "triangles", "none", "Export the mesh as well.")
        whole = _welded(_united([_part(document, one) for one in chosen]))
        return Mesh(whole.vertices, whole.faces, UNITS, whole.colours)


def _primitives(document: Document) -> Iterator[_Primitive]:
    """Iterate over the triangle primitives of the scene."""
    for node, world in _placed_nodes(document.root):
        if "mesh" not in node:
            continue
        mesh = document.root["meshes"][node["mesh"]]
        # Of a skinned mesh the joints decide the place; in their rest pose it stays where it is.
        placed = np.eye(4) if "skin" in node else world
        for one in mesh["primitives"]:
            if one.get("mode", _TRIANGLES) == _TRIANGLES:
                yield _Primitive(mesh, one, one.get("targets", []), placed)


def _part(document: Document, one: _Primitive) -> _PlacedMesh:
    attributes = one.entry["attributes"]
    vertices = _vectors(document, attributes["POSITION"])
    _require_moderate(len(one.targets), len(vertices))
    moved = np.zeros((len(one.targets), *vertices.shape))
    for index, target in enumerate(one.targets):
        if "POSITION" in target:
            moved[index] = _vectors(document, target["POSITION"])
    indices = np.arange(len(vertices))
    if "indices" in one.entry:
        indices = document.integers(one.entry["indices"])
    colours = document.numbers(attributes["COLOR_0"])[:, :3] if "COLOR_0" in attributes else None
    turn, place = one.world[:3, :3], one.world[:3, 3]
    return _PlacedMesh(
        vertices=vertices @ turn.T + place,
        targets=moved @ turn.T,
        names=target_names(one.mesh, len(one.targets)) if one.targets else (),
        faces=indices.reshape(-1, 3),
        colours=colours,
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


def target_names(mesh: dict[str, Any], count: int) -> tuple[str, ...]:
    """The names of a mesh's morph targets, all different; numbers where the file has none."""
    names = mesh.get("extras", {}).get("targetNames")
    if names is None:
        log.warning("the morph targets have no names: they are called target1, target2, ...")
        return tuple(f"target{index}" for index in range(1, count + 1))
    if len(names) != count or len(set(names)) != count:
        raise ValueError(f"{len(set(names))} names for {count} morph targets")
    return tuple(str(name) for name in names)


def _colours(parts: Sequence[_PlacedMesh]) -> FloatArray | None:
    """Colours (V, 3) as a screen shows them, if all parts have some; glTF's are linear light."""
    colours = [part.colours for part in parts if part.colours is not None]
    if len(colours) < len(parts):
        return None
    return np.asarray(np.clip(np.concatenate(colours), 0, 1) ** (1 / _GAMMA))


def _placed_nodes(root: dict[str, Any]) -> Iterator[tuple[dict[str, Any], FloatArray]]:
    """The nodes of the scene with their transforms to the world, (4, 4), each node once."""
    nodes = root["nodes"]
    scenes = root.get("scenes") or [{"nodes": list(range(len(nodes)))}]
    waiting = [(index, np.eye(4)) for index in reversed(scenes[root.get("scene", 0)]["nodes"])]
    seen: set[int] = set()
    while waiting:
        index, above = waiting.pop()
        if index in seen:
            continue
        seen.add(index)
        world = above @ _local(nodes[index])
        yield nodes[index], world
        waiting += [(child, world) for child in reversed(nodes[index].get("children", []))]


def _local(node: dict[str, Any]) -> FloatArray:
    """A node's own transform, (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    from scipy.spatial.transform import Rotation  # takes its time

    local = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", [0.0, 0.0, 0.0, 1.0])).as_matrix()
    local[:3, :3] = turn * np.array(node.get("scale", [1.0] * 3), dtype=np.float64)
    local[:3, 3] = node.get("translation", [0.0] * 3)
    return local
