"""Stanford PLY files, binary and text: the vertices, faces and colours of one mesh.

The header declares elements (``vertex``, ``face``, others), each with a number of rows and the
properties of a row; a property is one number or a list of them. A text file is turned into the
binary layout of float64 first, so that there is one way to read both. Quads and polygons become
triangle fans.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import Mesh
from facert.errors import InputError, reading
from facert.io.guarded import moderate_file

MAX_HEADER = 2**16
MAX_RAGGED = 2**22
"""Most rows of an element whose rows differ in length: they are read one by one."""
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")
_COLOURS = ("red", "green", "blue")

Columns = dict[str, NDArray[np.generic] | list[NDArray[np.generic]]]
"""The values of each property: an array, or a list of arrays where rows differ in length."""


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


@dataclass(frozen=True)
class _Header:
    text: bool
    elements: list[_Element]


def read_ply(path: Path) -> Mesh:
    """Read the mesh of a PLY file.

    Raises
    ------
    InputError
        Naming the file, and the line of the header or the element that is at fault.
    """
    with reading(path):
        content = moderate_file(path).read_bytes()
        end = _end_of_header(content)
        header = _parse_header(content[:end])
        body = _as_float64(content[end:]) if header.text else content[end:]
        return _mesh(dict(_read_elements(header, body)), header)


def _end_of_header(content: bytes) -> int:
    """Where the data begin: after the line ``end_header``."""
    start = content.find(b"\nend_header", 0, MAX_HEADER)
    end = content.find(b"\n", start + 1)
    if not content.startswith(b"ply") or start < 0 or end < 0:
        raise InputError("file", "a PLY file", "no header of one", "Export the mesh again.")
    return end + 1


def _parse_header(content: bytes) -> _Header:
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
            raise InputError(
                f"line {number}", "a PLY header", repr(line[:60]), "Export the mesh again."
            ) from None
    return _Header(text, elements)


def _as_float64(body: bytes) -> bytes:
    """The numbers of a text file as they would lie in a binary one whose types are all float64."""
    try:
        return np.array(body.split(), dtype="<f8").tobytes()
    except ValueError as error:
        raise InputError("data", "numbers", str(error), "Export the mesh again.") from None


def _read_elements(header: _Header, body: bytes) -> Iterator[tuple[str, Columns]]:
    offset = 0
    for element in header.elements:
        if header.text:
            element = _Element(element.name, element.count, _all_float64(element.properties))
        try:
            columns, offset = _read_element(element, body, offset)
        except (ValueError, OverflowError):
            expected = f"{element.count} whole rows"
            raise InputError(
                f"element {element.name}", expected, "fewer or damaged ones", "Export it again."
            ) from None
        yield element.name, columns


def _all_float64(properties: list[_Property]) -> list[_Property]:
    return [_Property(one.name, "<f8", "<f8" if one.length else "") for one in properties]


def _read_element(element: _Element, body: bytes, offset: int) -> tuple[Columns, int]:
    """All rows at once if their lists are as long as the first row's, else one by one."""
    if not element.count or not element.properties:
        return {}, offset
    first, _ = _read_row(element, body, offset)
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for one, values in zip(element.properties, first, strict=True):
        if one.length:
            fields += [(f"length of {one.name}", one.length), (one.name, one.type, values.shape)]
        else:
            fields.append((one.name, one.type))
    dtype = np.dtype(fields)
    if offset + element.count * dtype.itemsize <= len(body):
        rows = np.frombuffer(body, dtype, element.count, offset)
        lengths = [rows[name] for name in dtype.names or () if name.startswith("length of ")]
        if all((length == length[0]).all() for length in lengths):
            columns: Columns = {one.name: rows[one.name] for one in element.properties}
            return columns, offset + rows.nbytes
    if element.count > MAX_RAGGED or not any(one.length for one in element.properties):
        raise ValueError("too many rows, or too few bytes")
    return _read_ragged(element, body, offset)


def _read_ragged(element: _Element, body: bytes, offset: int) -> tuple[Columns, int]:
    rows = []
    for _ in range(element.count):
        row, offset = _read_row(element, body, offset)
        rows.append(row)
    columns = zip(*rows, strict=True)
    names = (one.name for one in element.properties)
    return {name: list(column) for name, column in zip(names, columns, strict=True)}, offset


def _read_row(element: _Element, body: bytes, offset: int) -> tuple[list[NDArray[np.generic]], int]:
    """The values of each property in the row that begins at `offset`, and where it ends."""
    row = []
    for one in element.properties:
        count = 1
        if one.length:
            count = _length(int(np.frombuffer(body, one.length, 1, offset)[0]))
            offset += np.dtype(one.length).itemsize
        values = np.frombuffer(body, one.type, count, offset)
        offset += values.nbytes
        row.append(values)
    return row, offset


def _length(count: int) -> int:
    if count < 0:
        raise ValueError("a length below 0")
    return count


def _mesh(elements: dict[str, Columns], header: _Header) -> Mesh:
    vertex, face = elements.get("vertex", {}), elements.get("face", {})
    vertices = _stacked(vertex, ("x", "y", "z"))
    if vertices is None:
        raise InputError("element vertex", "x, y, z", "none", "Export the mesh again.")
    colours = _stacked(vertex, _COLOURS)
    if colours is not None:
        colours = colours / _brightest(header)
    corners = next((face[name] for name in _CORNERS if name in face), [])
    return Mesh(vertices, _triangles(corners), colours=colours)


def _stacked(columns: Columns, names: tuple[str, ...]) -> FloatArray | None:
    if not all(name in columns for name in names):
        return None
    return np.column_stack([np.asarray(columns[name], dtype=np.float64) for name in names])


def _brightest(header: _Header) -> float:
    """The value of full red in the file: 1 for floats, the type's largest for integers."""
    vertex = next(element for element in header.elements if element.name == "vertex")
    red = next(np.dtype(one.type) for one in vertex.properties if one.name == "red")
    return float(np.iinfo(red).max) if red.kind in "iu" else 1.0


def _triangles(corners: NDArray[np.generic] | list[NDArray[np.generic]]) -> IntArray:
    """Triangle fans (F, 3) of polygons."""
    if isinstance(corners, np.ndarray):
        return _fans(corners)
    parts = [_fans(polygon[None]) for polygon in corners]
    return np.concatenate(parts) if parts else np.empty((0, 3), dtype=np.int64)


def _fans(corners: NDArray[np.generic]) -> IntArray:
    """Triangles of polygons with the same number of corners (n, k), all at the first corner."""
    if corners.ndim != 2 or corners.shape[1] < 3 or not np.isfinite(corners).all():
        raise InputError("element face", "three corners or more", "fewer", "Export it again.")
    ends = np.arange(1, corners.shape[1] - 1)
    first = np.broadcast_to(corners[:, :1], (len(corners), len(ends)))
    fan = np.stack([first, corners[:, ends], corners[:, ends + 1]], axis=2)
    return fan.reshape(-1, 3).astype(np.int64)
