"""Stanford PLY files, binary and text: the vertices, faces and colours of one mesh.

The header declares elements (``vertex``, ``face``, others), each with a number of rows and the
properties of a row; a property is one number or a list of them. A text file is turned into the
binary layout of float64 first, so that there is one way to read both. Quads and polygons become
triangle fans.
"""

from __future__ import annotations

import struct
import warnings
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import FloatArray, IntArray
from facert.data.memory import FileMemory
from facert.data.rig import Mesh
from facert.errors import InputError, reading
from facert.io.guarded import moderate_file

MAX_HEADER = 2**16
MAX_RAGGED = 2**22
"""Most rows of an element whose rows differ in length: each is looked for by itself."""
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_LENGTH = "length of "
_COPIES = 6  # of the file's size: the content, its numbers, corners and triangles as they grow
_CORNERS = ("vertex_indices", "vertex_index")
_COLOURS = ("red", "green", "blue")

_Field = tuple[str, str, tuple[int, ...]]
_Part = tuple[IntArray, NDArray[np.generic]]
Columns = dict[str, list[_Part]]
"""The values of each property: rows whose lists are equally long, and their values in an array."""


@dataclass(frozen=True)
class _Property:
    """A number (`length` is empty), or a list whose length is of that type."""

    name: str
    type: str
    length: str = ""


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]


def read_ply(path: Path) -> Mesh:
    """Read the mesh of a PLY file.

    Raises `InputError` naming the file, and the line of the header or the element that is at fault.
    """
    with reading(path):
        memory = FileMemory(moderate_file(path))
        memory.require(_COPIES * path.stat().st_size, "file")
        content = path.read_bytes()
        end = _end_of_header(content)
        elements, text = _parse_header(content[:end])
        body = _as_float64(content[end:]) if text else content[end:]
        return _mesh(_read_elements(elements, body, text), elements)


def _end_of_header(content: bytes) -> int:
    """Offset at which the data begin: after the line ``end_header``."""
    start = content.find(b"\nend_header", 0, MAX_HEADER)
    end = content.find(b"\n", start + 1)
    if not content.startswith(b"ply") or start < 0 or end < 0:
        raise InputError("file", "a PLY file", "no header of one", "Export the mesh again.")
    return end + 1


def _parse_header(content: bytes) -> tuple[list[_Element], bool]:
    """The elements, and whether they are written as text."""
    order, text, elements = "<", False, list[_Element]()
    for number, line in enumerate(content.decode("ascii", errors="replace").splitlines(), 1):
        try:
            match line.split():
                case ["format", kind, _]:
                    order, text = _ORDERS[kind], kind == "ascii"
                case ["element", name, count]:
                    elements.append(_Element(name, _length(int(count)), []))
                case ["property", "list", length, kind, name]:
                    length, kind = order + _TYPES[length], order + _TYPES[kind]
                    elements[-1].properties.append(_Property(name, kind, length))
                case ["property", kind, name]:
                    elements[-1].properties.append(_Property(name, order + _TYPES[kind]))
                case ["property" | "element" | "format", *_]:
                    raise ValueError
        except (KeyError, ValueError, IndexError):
            found, fix = repr(line[:60]), "Export the mesh again."
            raise InputError(f"line {number}", "a PLY header", found, fix) from None
    return elements, text


def _as_float64(body: bytes) -> bytes:
    """Bytes of a text file's numbers as in a binary file whose types are all float64."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # of what is no number
            return np.fromstring(body, "<f8", sep=" ").tobytes()
    except (ValueError, DeprecationWarning):
        raise InputError("data", "numbers", "other words", "Export the mesh again.") from None


def _read_elements(elements: list[_Element], body: bytes, text: bool) -> dict[str, Columns]:
    offset, found = 0, dict[str, Columns]()
    for element in elements:
        try:
            found[element.name], offset = _read_element(element, body, offset, text)
        except (ValueError, OverflowError, struct.error):
            field, expected = f"element {element.name}", f"{element.count} whole rows"
            damage = "fewer or damaged ones"
            raise InputError(field, expected, damage, "Export it again.") from None
    return found


def _read_element(element: _Element, body: bytes, offset: int, text: bool) -> tuple[Columns, int]:
    """Read an element: all rows at once if their lists are equally long."""
    names = [one.name for one in element.properties]
    if not element.count or not names:
        return {}, offset
    dtype = _row_type(element, body, offset, text)
    if offset + element.count * dtype.itemsize <= len(body):
        rows = np.frombuffer(body, dtype, element.count, offset)
        lengths = [rows[name] for name in dtype.names or () if name.startswith(_LENGTH)]
        if all((length == length[0]).all() for length in lengths):
            every = np.arange(len(rows))
            return {name: [(every, rows[name])] for name in names}, offset + rows.nbytes
    if element.count > MAX_RAGGED or not any(one.length for one in element.properties):
        raise ValueError("too many rows, or too few bytes")
    return _read_ragged(element, body, offset, text)


def _read_ragged(element: _Element, body: bytes, offset: int, text: bool) -> tuple[Columns, int]:
    """Read rows whose lists differ in length: those that are alike at once."""
    starts, lengths, end = _find_rows(element, body, offset, text)
    content = np.frombuffer(body, np.uint8)
    columns: Columns = {one.name: [] for one in element.properties}
    for rows in _alike(lengths):
        dtype = _row_type(element, body, int(starts[rows[0]]), text)
        windows = np.lib.stride_tricks.sliding_window_view(content, dtype.itemsize)
        values = windows[starts[rows]].view(dtype)[:, 0]
        for name, parts in columns.items():
            parts.append((rows, values[name]))
    return columns, end


def _find_rows(
    element: _Element, body: bytes, offset: int, text: bool
) -> tuple[IntArray, IntArray, int]:
    """Where each row begins (n,), the lengths of its lists (n, lists), and where the last ends."""
    order = ">" if any(one.type[0] == ">" for one in element.properties) else "<"
    steps, before = [], 0  # of each list: bytes before it, its length's type and size, a value's
    for one in element.properties:
        size = np.dtype("<f8" if text else one.type).itemsize
        if one.length:
            kind = struct.Struct(order + np.dtype("<f8" if text else one.length).char)
            steps.append((before, kind.unpack_from, kind.size, size))
        before = 0 if one.length else before + size
    starts = np.empty(element.count, dtype=np.int64)
    lengths = np.empty((element.count, len(steps)), dtype=np.int64)
    for row in range(element.count):
        starts[row] = offset
        for place, (skipped, unpack, width, size) in enumerate(steps):
            offset += skipped
            lengths[row, place] = length = _length(int(unpack(body, offset)[0]))
            offset += width + length * size
        offset += before
    if offset > len(body):
        raise ValueError("too few bytes")
    return starts, lengths, offset


def _alike(lengths: IntArray) -> list[IntArray]:
    """The rows of equal lengths (n, lists), group by group."""
    group = np.zeros(len(lengths), dtype=np.int64)
    for column in lengths.T:
        _, here = np.unique(column, return_inverse=True)
        _, group = np.unique(group * (here.max() + 1) + here, return_inverse=True)
    order = np.argsort(group, kind="stable")
    return np.split(order, np.cumsum(np.bincount(group))[:-1])


def _row_type(element: _Element, body: bytes, offset: int, text: bool) -> np.dtype[np.void]:
    """The layout of the row that begins at `offset`, whose lists are as long as it states."""
    fields: list[_Field] = []
    for one in element.properties:
        shape: tuple[int, ...] = ()
        if one.length:
            length = "<f8" if text else one.length
            start = offset + _layout(tuple(fields)).itemsize
            shape = (_length(int(np.frombuffer(body, length, 1, start)[0])),)
            fields.append((_LENGTH + one.name, length, ()))
        fields.append((one.name, "<f8" if text else one.type, shape))
    return _layout(tuple(fields))


@lru_cache(maxsize=256)
def _layout(fields: tuple[_Field, ...]) -> np.dtype[np.void]:
    return np.dtype(list(fields))


def _length(count: int) -> int:
    if count < 0:
        raise ValueError("a length below 0")
    return count


def _mesh(columns: dict[str, Columns], elements: list[_Element]) -> Mesh:
    vertex, face = columns.get("vertex", {}), columns.get("face", {})
    vertices = _stacked(vertex, ("x", "y", "z"))
    if vertices is None:
        raise InputError("element vertex", "x, y, z", "none", "Export the mesh again.")
    colours = _stacked(vertex, _COLOURS)
    if colours is not None:
        colours = colours / _brightest(elements)
    corners = next((face[name] for name in _CORNERS if name in face), [])
    return Mesh(vertices, _triangles(corners), colours=colours)


def _stacked(columns: Columns, names: tuple[str, ...]) -> FloatArray | None:
    """Numbers of every row (n, names); None where one has none, or a list."""
    parts = [part for name in names for part in columns.get(name, [(None, None)])]
    if any(values is None or values.ndim > 1 for _, values in parts):
        return None
    found = np.empty((sum(len(rows) for rows, _ in columns[names[0]]), len(names)))
    for place, name in enumerate(names):
        for rows, values in columns[name]:
            found[rows, place] = values
    return found


def _brightest(elements: list[_Element]) -> float:
    """The value of full red in the file: 1 for floats, the type's largest for integers."""
    vertex = next(element for element in elements if element.name == "vertex")
    red = next(np.dtype(one.type) for one in vertex.properties if one.name == "red")
    return float(np.iinfo(red).max) if red.kind in "iu" else 1.0


def _triangles(corners: list[_Part]) -> IntArray:
    """Triangle fans (F, 3) of polygons, in the order of the rows."""
    fans = [np.empty((0, 3), dtype=np.int64), *(_fans(polygons) for _, polygons in corners)]
    rows = [np.repeat(rows, max(0, values.shape[1] - 2)) for rows, values in corners]
    order = np.argsort(np.concatenate([np.empty(0, dtype=np.int64), *rows]), kind="stable")
    return np.concatenate(fans)[order]


def _fans(corners: NDArray[np.generic]) -> IntArray:
    """Triangles of polygons with the same number of corners (n, k), all at the first corner."""
    if corners.ndim != 2 or corners.shape[1] < 3 or not np.isfinite(corners).all():
        raise InputError("element face", "three corners or more", "fewer", "Export it again.")
    ends = np.arange(1, corners.shape[1] - 1)
    first = np.broadcast_to(corners[:, :1], (len(corners), len(ends)))
    fan = np.stack([first, corners[:, ends], corners[:, ends + 1]], axis=2)
    return fan.reshape(-1, 3).astype(np.int64)
