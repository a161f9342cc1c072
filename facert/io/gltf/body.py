"""What a character has beside its shapes: eyeballs, teeth, hair, neck; for pictures only.

Pictures show the face, so that of a whole body only what lies around it is kept: triangles with a
corner near the face. A stage, a sky and feet are not.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.rig import CLAY
from facert.data.text import listed, printable
from facert.io.gltf.parts import (
    GAMMA,
    PlacedMesh,
    Primitive,
    placed_mesh,
    primitives,
    united,
    welded,
)
from facert.io.gltf.scene import Scene
from facert.io.gltf.textures import texture_colours

log = logging.getLogger("facert")

MOST = 1_000_000
"""Vertices at most that are looked at."""
AROUND = 0.15  # of the face's size, beyond its box
_LISTED = 12
_SEEN_THROUGH = "BLEND"


def body_of(scene: Scene, face: FloatArray, nodes: Sequence[int] = ()) -> PlacedMesh | None:
    """The meshes without targets around a face (V, 3), and how they follow driven nodes.

    Those that are seen through, such as a cornea, would hide what is behind them: they are left
    out. The log names what is shown, and what is not.
    """
    parts: list[PlacedMesh] = []
    shown: dict[str, None] = {}
    clear: dict[str, None] = {}
    left = MOST
    for one in primitives(scene):
        if one.targets:
            continue
        name = _name(scene, one)
        left -= _count(scene, one)
        if left < 0:
            log.warning("%s and what follows are too large to be shown", printable(name))
            break
        if _material(scene, one).get("alphaMode") == _SEEN_THROUGH:
            clear[name] = None
            continue
        part = placed_mesh(scene, one, nodes=nodes)
        part = _cut(replace(part, colours=_colours(scene, one, part)), face)
        if len(part.faces):
            parts.append(part)
            shown[name] = None
    if shown:
        log.info("without shapes, for pictures only: %s", listed(list(shown), _LISTED))
    if shown and clear:
        log.info("seen through, so not shown: %s", listed(list(clear), _LISTED))
    return welded(united(parts, scene.document.memory)) if parts else None


def _cut(part: PlacedMesh, face: FloatArray) -> PlacedMesh:
    """The triangles with a corner near the face, and their vertices."""
    low, high = face.min(axis=0), face.max(axis=0)
    around = AROUND * float((high - low).max())
    near = ((part.vertices > low - around) & (part.vertices < high + around)).all(axis=1)
    if len(part.faces) and part.faces.max() >= len(near):
        raise ValueError("triangles of vertices that are not there")
    faces = part.faces[near[part.faces].any(axis=1)]
    used, compact = np.unique(faces, return_inverse=True)
    return replace(
        part,
        vertices=part.vertices[used],
        targets=part.targets[:, used],
        faces=compact.reshape(-1, 3),
        colours=None if part.colours is None else part.colours[used],
        shares=part.shares[used],
    )


def _colours(scene: Scene, one: Primitive, part: PlacedMesh) -> FloatArray:
    """Colours in linear light (V, 3): the vertices' own, else the material's, else clay's."""
    if part.colours is not None:
        return part.colours
    material = _material(scene, one)
    surface = material.get("pbrMetallicRoughness", {})
    factor = np.array(surface.get("baseColorFactor", [1.0] * 3), dtype=np.float64)[:3]
    texture = texture_colours(scene.document, material, one.entry["attributes"])
    if texture is not None:
        return np.asarray(texture**GAMMA * factor)
    plain = "baseColorTexture" not in surface and "baseColorFactor" in surface
    return np.tile(factor if plain else np.array(CLAY) ** GAMMA, (len(part.vertices), 1))


def _material(scene: Scene, one: Primitive) -> dict[str, Any]:
    number = one.entry.get("material")
    found: dict[str, Any] = {} if number is None else scene.document.root["materials"][number]
    return found


def _count(scene: Scene, one: Primitive) -> int:
    accessor = scene.document.root["accessors"][one.entry["attributes"]["POSITION"]]
    return int(accessor["count"])


def _name(scene: Scene, one: Primitive) -> str:
    node, mesh = scene.document.root["nodes"][one.node], scene.document.root["meshes"][one.mesh]
    return str(node.get("name") or mesh.get("name") or f"mesh {one.mesh}")
