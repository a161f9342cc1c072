"""Meshes of a glTF scene, placed in it: triangles, what moves them, and their colours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.memory import FLOAT, FileMemory
from facert.io.gltf.document import Document
from facert.io.gltf.scene import Scene, displaced, mirrored, transformed

_TRIANGLES = 4
GAMMA = 2.2


@dataclass(frozen=True, eq=False)
class Primitive:
    """Triangles in the document: their node and mesh, their entry in it, and its targets."""

    node: int
    mesh: int
    entry: dict[str, Any]
    targets: list[dict[str, Any]]


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """Vertices and how morph targets move them, in the space of the scene."""

    vertices: FloatArray  # (V, 3)
    targets: FloatArray  # (K, V, 3)
    names: tuple[str, ...]
    faces: IntArray
    colours: FloatArray | None
    shares: FloatArray
    """How far vertices follow driven nodes, (V, N)."""


def primitives(scene: Scene) -> Iterator[Primitive]:
    """Iterate over the triangle primitives of the scene."""
    for number in scene.nodes:
        node = scene.document.root["nodes"][number]
        if "mesh" not in node:
            continue
        for one in scene.document.root["meshes"][node["mesh"]]["primitives"]:
            if one.get("mode", _TRIANGLES) == _TRIANGLES:
                yield Primitive(number, node["mesh"], one, one.get("targets", []))


def placed_mesh(
    scene: Scene, one: Primitive, names: Sequence[str] = (), nodes: Sequence[int] = ()
) -> PlacedMesh:
    """Triangles with the names of their targets, and how they follow some driven nodes."""
    document, attributes = scene.document, one.entry["attributes"]
    vertices = _vectors(document, attributes["POSITION"])
    require_targets(document.memory, len(one.targets), len(vertices))
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
    return PlacedMesh(
        vertices=transformed(vertices, placement),
        targets=displaced(moved, placement),
        names=tuple(names[: len(one.targets)]),
        faces=corners[:, ::-1] if mirrored(placement) else corners,
        colours=colours,
        shares=_shares(scene, one, len(vertices), nodes),
    )


def _shares(scene: Scene, one: Primitive, vertices: int, nodes: Sequence[int]) -> FloatArray:
    """How far vertices follow each of some nodes, (V, N)."""
    found = scene.shares(one.node, one.entry["attributes"], nodes)
    if found is None:
        scene.document.memory.require(FLOAT * vertices * len(nodes), "nodes")
        found = np.zeros((vertices, len(nodes)))
        place = scene.above(one.node, nodes)
        if place >= 0:
            found[:, place] = 1.0
    return found


def united(parts: Sequence[PlacedMesh], memory: FileMemory) -> PlacedMesh:
    """Join parts into one mesh; a target that a part does not have leaves it at rest."""
    names = tuple(dict.fromkeys(name for part in parts for name in part.names))
    row_of = {name: row for row, name in enumerate(names)}
    sizes = [len(part.vertices) for part in parts]
    require_targets(memory, len(names), sum(sizes))
    starts = np.cumsum([0, *sizes[:-1]])
    targets = np.zeros((len(names), sum(sizes), 3))
    for part, start in zip(parts, starts, strict=True):
        rows = [row_of[name] for name in part.names]
        targets[rows, start : start + len(part.vertices)] = part.targets
    return PlacedMesh(
        vertices=np.concatenate([part.vertices for part in parts]),
        targets=targets,
        names=names,
        faces=np.concatenate([part.faces + n for part, n in zip(parts, starts, strict=True)]),
        colours=_colours(parts),
        shares=np.concatenate([part.shares for part in parts]),
    )


def welded(part: PlacedMesh) -> PlacedMesh:
    """The part with vertices of equal place and motion made one, in the order of the first ones."""
    motion = part.targets.transpose(1, 0, 2).reshape(len(part.vertices), -1)
    rows = np.concatenate([part.vertices, motion, part.shares], axis=1)
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
        shares=part.shares[kept],
    )


def require_targets(memory: FileMemory, targets: int, vertices: int) -> None:
    """Raise InputError for more targets of vertices than memory should hold."""
    memory.require(3 * FLOAT * max(targets, 1) * vertices, "meshes")


def _vectors(document: Document, accessor: int) -> FloatArray:
    vectors = document.numbers(accessor)
    if vectors.shape[1] != 3:
        raise ValueError("positions that are no vectors")
    return vectors


def _colours(parts: Sequence[PlacedMesh]) -> FloatArray | None:
    """Colours (V, 3) as a screen shows them, if all parts have some; glTF's are linear light."""
    colours = [part.colours for part in parts if part.colours is not None]
    if len(colours) < len(parts):
        return None
    return np.asarray(np.clip(np.concatenate(colours), 0, 1) ** (1 / GAMMA))
