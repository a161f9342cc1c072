"""GLB (binary glTF 2.0): a mesh with morph targets and an animation of their weights.

A GLB file is a header, a chunk of JSON and a chunk of bytes. All numbers lie in the latter as
little-endian arrays; the JSON holds of each (an accessor) its place, its type and its bounds.
Blender, Maya, Unreal and web viewers read the targets' names from the mesh's ``extras``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import Mesh
from facert.data.units import in_metres
from facert.data.version import CREATED_BY
from facert.errors import InputError
from facert.io.gltf.buffer import Buffer, write_container
from facert.mesh.morphs import Morphs
from facert.mesh.normals import vertex_normals


def write_glb(morphs: Morphs, path: Path, overwrite: bool = False) -> None:
    """Write a mesh with morph targets and the animation of their weights, which begins at 0 s.

    glTF counts in metres: a mesh in a known unit is scaled by its node; of another unit or none
    the numbers stay. A single frame makes no animation: it is how the mesh is to be seen.

    Raises `InputError` when the mesh has no triangles, or the file would exceed 4 GiB, as much as
    GLB can hold, and `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    if not len(morphs.neutral.faces):
        raise InputError("/faces", "triangles", "none", "Give a mesh with faces.", str(path))
    buffer = Buffer()
    root = _document(morphs, Path(path).stem, buffer)
    write_container(root, buffer, path, overwrite)


def _document(morphs: Morphs, name: str, buffer: Buffer) -> dict[str, Any]:
    node: dict[str, Any] = {"name": name, "mesh": 0}
    metres = in_metres(morphs.neutral.units) or 1.0
    if metres != 1.0:
        node["scale"] = [metres] * 3
    mesh = _mesh(morphs, name, buffer)
    moving = len(morphs.time) > 1
    animations = {"animations": [_animation(morphs, name, buffer)]} if moving else {}
    return {
        "asset": {"version": "2.0", "generator": CREATED_BY},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [mesh],
        "materials": [_material(morphs.neutral)],
        **animations,
    }


def _mesh(morphs: Morphs, name: str, buffer: Buffer) -> dict[str, Any]:
    neutral = morphs.neutral
    normals = _unit_normals(neutral.vertices, neutral.faces)
    attributes = {
        "POSITION": buffer.vertices(neutral.vertices),
        "NORMAL": buffer.vertices(normals),
    }
    if neutral.colours is not None:
        attributes["COLOR_0"] = buffer.vertices(neutral.colours**2.2)  # glTF's are linear light
    targets = [
        {
            "POSITION": buffer.vertices(target),
            "NORMAL": buffer.vertices(
                _unit_normals(neutral.vertices + target, neutral.faces) - normals
            ),
        }
        for target in morphs.targets
    ]
    primitive = {
        "attributes": attributes,
        "indices": buffer.corners(neutral.faces),
        "material": 0,
        "targets": targets,
    }
    return {
        "name": name,
        "primitives": [primitive],
        "weights": morphs.weights[0].tolist() if len(morphs.time) == 1 else [0.0] * len(targets),
        "extras": {"targetNames": list(morphs.names)},
    }


def _animation(morphs: Morphs, name: str, buffer: Buffer) -> dict[str, Any]:
    sampler = {
        "input": buffer.keys(morphs.time - morphs.time[0]),
        "output": buffer.keys(morphs.weights.ravel()),
        "interpolation": "LINEAR",
    }
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    return {"name": name, "samplers": [sampler], "channels": [channel]}


def _material(neutral: Mesh) -> dict[str, Any]:
    clay = [0.60, 0.48, 0.40, 1.0] if neutral.colours is None else [1.0] * 4
    surface = {"baseColorFactor": clay, "metallicFactor": 0.0, "roughnessFactor": 0.7}
    return {"name": "face", "doubleSided": True, "pbrMetallicRoughness": surface}


def _unit_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Normals (V, 3) of length 1, as glTF wants them, of vertices without a triangle too."""
    normals = vertex_normals(vertices, faces)
    normals[np.linalg.norm(normals, axis=1) < 0.5] = (0.0, 0.0, 1.0)
    return normals
