"""Faces in glTF files and VRM avatars: meshes with morph targets as a rig, or at rest.

A character is often cut into several meshes (face, teeth, lashes) whose targets bear the same
names: they become one rig, placed as the scene and its skeleton place them, with all weights at 0.
glTF counts in metres, and y is up.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.drivers import Drivers
from facert.data.rig import Mesh, Rig
from facert.data.text import printable
from facert.errors import InputError
from facert.io.gltf.body import body_of
from facert.io.gltf.document import Document, open_gltf
from facert.io.gltf.driven import Driven, driven_by
from facert.io.gltf.names import target_names
from facert.io.gltf.parts import (
    PlacedMesh,
    Primitive,
    placed_mesh,
    primitives,
    require_targets,
    united,
    welded,
)
from facert.io.gltf.scene import scene_of
from facert.io.gltf.vrm import Bind, expressions_of, looks_back, target_weights

log = logging.getLogger("facert")

UNITS = "m"
SMALLEST, LARGEST = 0.005, 20.0
"""Metres between which a face is, or the body that it belongs to."""
TARGETS, EXPRESSIONS = "targets", "expressions"
"""What the shapes of a rig are: each morph target alone, or the expressions of a VRM avatar."""


def read_gltf_rig(path: Path, shapes: str | None = None, drivers: Drivers | None = None) -> Rig:
    """Read all meshes with morph targets as one rig, in metres, and its surroundings.

    Targets of the same name belong together. Exporters cut a vertex in several where texture or
    normals jump: those that share place and motion are one. With `shapes` "expressions", the shapes
    are the expressions of a VRM avatar. Meshes without targets are the rig's body, as far as they
    are near the face. `drivers` let controls turn and shift nodes, whether they are shapes or not.

    Raises `InputError` when the file cannot be read safely, no mesh has morph targets, or there are
    no such shapes, or no such nodes.
    """
    with open_gltf(path) as document:
        scene = scene_of(document)
        there = [one for one in primitives(scene) if one.targets]
        if not there:
            raise InputError(
                "meshes", "morph targets", "none", "Export the mesh with its shape keys."
            )
        names = target_names(document)
        _log_default_weights(document, there, names)
        expressions = expressions_by_name(document, shapes)
        shown = (name for one in there for name in names[one.mesh][: len(one.targets)])
        of_shapes = tuple(expressions) if shapes == EXPRESSIONS else tuple(dict.fromkeys(shown))
        driven = driven_by(scene, of_shapes, drivers)
        parts = [placed_mesh(scene, one, names[one.mesh], driven.nodes) for one in there]
        if shapes == EXPRESSIONS:
            pairs = zip(parts, there, strict=True)
            parts = [_expressed(document, part, one.mesh, expressions) for part, one in pairs]
        whole = welded(united(parts, document.memory))
        _warn_of_size(whole.vertices)
        require_targets(document.memory, len(driven.controls), len(whole.vertices))
        return _rig(whole, body_of(scene, whole.vertices, driven.nodes), driven)


def _rig(whole: PlacedMesh, body: PlacedMesh | None, driven: Driven) -> Rig:
    idle = len(driven.controls) - len(whole.names)
    parts = [whole] if body is None else [whole, body]
    motion = driven.motion
    if motion is not None:
        motion = replace(motion, shares=np.concatenate([part.shares for part in parts]))
    return Rig(
        whole.vertices,
        np.pad(whole.targets, ((0, idle), (0, 0), (0, 0))) if idle else whole.targets,
        driven.controls,
        whole.faces,
        UNITS,
        whole.colours,
        None if body is None else Mesh(body.vertices, body.faces, UNITS, body.colours),
        motion,
    )


def read_gltf_mesh(path: Path) -> Mesh:
    """Read the meshes at rest, in metres: those with morph targets, else all; see `read_gltf_rig`.

    Raises `InputError` when the file cannot be read safely, or has no triangles.
    """
    with open_gltf(path) as document:
        scene = scene_of(document)
        there = list(primitives(scene))
        chosen = [one for one in there if one.targets] or there
        if not chosen:
            raise InputError("meshes", "triangles", "none", "Export the mesh as well.")
        names = target_names(document)
        parts = [placed_mesh(scene, one, names.get(one.mesh, ())) for one in chosen]
        whole = welded(united(parts, document.memory))
        return Mesh(whole.vertices, whole.faces, UNITS, whole.colours)


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
    document: Document, there: Sequence[Primitive], names: dict[int, tuple[str, ...]]
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


def _expressed(
    document: Document, part: PlacedMesh, mesh: int, expressions: dict[str, list[Bind]]
) -> PlacedMesh:
    """The part with expressions for targets: sums of those that they set."""
    require_targets(document.memory, len(expressions), len(part.vertices))
    weights = target_weights(expressions, mesh, len(part.targets))
    return replace(
        part, targets=np.tensordot(weights, part.targets, axes=1), names=tuple(expressions)
    )
