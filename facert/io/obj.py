"""A folder of Wavefront OBJ files as a rig: ``neutral.obj`` and one file a shape.

All files hold the same vertices in the same order. Quads and polygons become triangle fans;
texture coordinates, normals, groups and materials are left aside.
"""

from __future__ import annotations

import logging
from array import array
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain, groupby, pairwise
from operator import itemgetter
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.memory import FLOAT, FileMemory
from facert.data.rig import Mesh, Rig
from facert.errors import InputError, reading
from facert.io.guarded import files_in, read_old_text
from facert.mesh.registration import registered

log = logging.getLogger("facert")

NEUTRAL = "neutral"
MAX_VERTICES = 2**31
_CORNER = 2 * 3 * FLOAT  # bytes that a word may become: a triangle of a fan, as it is made an array
_COPIES = 3  # of the vertices of a shape: its displacements, those of all shapes, and of the rig


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
    memory = FileMemory(0)  # all of them count as one file
    neutral, faces = _vertices_and_faces(neutral_file, memory)
    shapes = [_read_shape(path, neutral, faces, memory) - neutral for path in shape_files]
    with reading(folder):
        names = tuple(path.stem for path in shape_files)
        rig = Rig(neutral=neutral, shapes=np.stack(shapes), names=names, faces=faces)
        return registered(rig, align)


def read_obj(path: Path) -> Mesh:
    """Read the mesh of one OBJ file.

    Raises `InputError` naming the file and the line that is at fault.
    """
    with reading(path):
        return Mesh(*_vertices_and_faces(path, FileMemory(0)))


def _vertices_and_faces(path: Path, memory: FileMemory) -> tuple[FloatArray, IntArray]:
    """The vertices (V, 3) and the triangles (F, 3) of one OBJ file."""
    vertices, triangles, number = array("d"), array("q"), 1
    with reading(path):
        text = read_old_text(path)
        FileMemory(path).require(_CORNER * text.count(" "), "file")
        for start, run in groupby(map(str.strip, text.splitlines()), itemgetter(slice(2))):
            lines = list(run)
            if start.rstrip() == "v":
                vertices.extend(_positions(lines, number))
            elif start.rstrip() == "f":
                triangles.extend(_triangles(lines, number, len(vertices) // 3))
            number += len(lines)
        if not vertices:
            raise InputError("file", "vertices", "none", "Export the mesh again.")
        memory.include(path)
        memory.require(_COPIES * FLOAT * len(vertices), "vertices")
    return np.array(vertices).reshape(-1, 3), np.array(triangles).reshape(-1, 3)


def _read_shape(path: Path, neutral: FloatArray, faces: IntArray, memory: FileMemory) -> FloatArray:
    vertices, own_faces = _vertices_and_faces(path, memory)
    if vertices.shape != neutral.shape:
        expected, fix = (
            f"{len(neutral)} as in {NEUTRAL}.obj",
            "Keep one vertex order in all shapes.",
        )
        raise InputError("vertices", expected, f"{len(vertices)}", fix, where=str(path))
    if len(own_faces) and not np.array_equal(own_faces, faces):
        log.warning("%s: other faces than the neutral; is the vertex order the same?", path.name)
    return vertices


def _positions(lines: list[str], number: int) -> Iterable[float]:
    """The coordinates of lines ``v X Y Z``, behind which a weight or colours may follow.

    Lines of as many words each are taken at once, others by themselves.
    """
    words = " ".join(lines).split()
    width, rest = divmod(len(words), len(lines))
    if not rest and width > 3 and set(words[::width]) == {"v"}:  # else lines differ in length
        with suppress(ValueError):  # which of them is at fault, is seen line by line
            columns = (words[axis::width] for axis in (1, 2, 3))
            rows = np.array([list(map(float, column)) for column in columns]).T
            return array("d", rows.tobytes())
    return chain.from_iterable(_position(line, number + place) for place, line in enumerate(lines))


def _position(line: str, number: int) -> tuple[float, float, float]:
    try:
        x, y, z = map(float, line.split()[1:4])
    except ValueError:
        raise _bad_line(line, number) from None
    return x, y, z


def _triangles(lines: list[str], number: int, count: int) -> Iterator[int]:
    """The corners of lines ``f A B C ...`` below `count` vertices, triangle by triangle."""
    for place, line in enumerate(lines):
        try:
            yield from _fan([_vertex(corner, count) for corner in line.split()[1:]])
        except ValueError:
            raise _bad_line(line, number + place) from None


def _bad_line(line: str, number: int) -> InputError:
    expected = "v X Y Z or f A B C ..."
    return InputError(f"line {number}", expected, repr(line[:60]), "Export it again.")


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
