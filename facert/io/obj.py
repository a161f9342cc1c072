"""A folder of Wavefront OBJ files as a rig: ``neutral.obj`` and one file a shape.

All files hold the same vertices in the same order. Quads and polygons become triangle fans;
texture coordinates, normals, groups and materials are left aside.
"""

from __future__ import annotations

import logging
from array import array
from itertools import pairwise
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import Mesh, Rig
from facert.errors import InputError, reading
from facert.io.guarded import files_in, read_old_text
from facert.mesh.registration import registered

log = logging.getLogger("facert")

NEUTRAL = "neutral"
MAX_VERTICES = 2**31


def read_obj_folder(folder: Path, align: bool = False) -> Rig:
    """Read ``neutral.obj`` and the other OBJ files of a folder, named and sorted by file name.

    Shapes that are not in register with the neutral are logged, or moved with `align`; see
    `facert.mesh.registration.registered`.

    Raises `InputError` naming the file and the line that is at fault, or two meshes that do not
    belong together.
    """
    files = [path for path in files_in(folder) if path.suffix.lower() == ".obj"]
    neutral_file = next((path for path in files if path.stem.lower() == NEUTRAL), None)
    shape_files = [path for path in files if path != neutral_file]
    if neutral_file is None or not shape_files:
        expected = f"{NEUTRAL}.obj and one OBJ file a shape"
        found = ", ".join(path.name for path in files[:4]) or "no OBJ files"
        fix = "Export the rest pose under that name, and every shape beside it."
        raise InputError("folder", expected, found, fix, where=str(folder))
    neutral, faces = _vertices_and_faces(neutral_file)
    shapes = [_read_shape(path, neutral, faces) - neutral for path in shape_files]
    with reading(folder):
        names = tuple(path.stem for path in shape_files)
        rig = Rig(neutral=neutral, shapes=np.stack(shapes), names=names, faces=faces)
        return registered(rig, align)


def read_obj(path: Path) -> Mesh:
    """Read the mesh of one OBJ file.

    Raises `InputError` naming the file and the line that is at fault.
    """
    with reading(path):
        return Mesh(*_vertices_and_faces(path))


def _vertices_and_faces(path: Path) -> tuple[FloatArray, IntArray]:
    """The vertices (V, 3) and the triangles (F, 3) of one OBJ file."""
    vertices, triangles = array("d"), array("q")
    with reading(path):
        for number, line in enumerate(read_old_text(path).splitlines(), start=1):
            keyword, *fields = line.split() or ("",)
            try:
                if keyword == "v":
                    x, y, z = map(float, fields[:3])  # a weight or colours may follow
                    vertices.extend((x, y, z))
                elif keyword == "f":
                    count = len(vertices) // 3
                    triangles.extend(_fan([_vertex(field, count) for field in fields]))
            except ValueError:
                field, expected = f"line {number}", "v X Y Z or f A B C ..."
                raise InputError(field, expected, repr(line[:60]), "Export it again.") from None
        if not vertices:
            raise InputError("file", "vertices", "none", "Export the mesh again.")
    return np.array(vertices).reshape(-1, 3), np.array(triangles).reshape(-1, 3)


def _read_shape(path: Path, neutral: FloatArray, faces: IntArray) -> FloatArray:
    vertices, own_faces = _vertices_and_faces(path)
    if vertices.shape != neutral.shape:
        expected, fix = (
            f"{len(neutral)} as in {NEUTRAL}.obj",
            "Keep one vertex order in all shapes.",
        )
        raise InputError("vertices", expected, f"{len(vertices)}", fix, where=str(path))
    if len(own_faces) and not np.array_equal(own_faces, faces):
        log.warning("%s: other faces than the neutral; is the vertex order the same?", path.name)
    return vertices


def _vertex(corner: str, count: int) -> int:
    """Index from 0 of a corner ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``; negative: backwards."""
    index = int(corner.split("/", 1)[0])
    position = index - 1 if index > 0 else count + index
    if index == 0 or not 0 <= position < MAX_VERTICES:
        raise ValueError("no such vertex")
    return position


def _fan(corners: list[int]) -> list[int]:
    """Triangles of a polygon, all at its first corner, one after the other."""
    if len(corners) < 3:
        raise ValueError("a face has three corners or more")
    return [corner for pair in pairwise(corners[1:]) for corner in (corners[0], *pair)]
