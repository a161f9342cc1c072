"""The guarded door for glTF 2.0: documents (``.gltf``) and binary files (``.glb``).

JSON describes arrays of numbers (accessors), where they lie in buffers (views), what they mean. All
of it is foreign: offsets, counts and strides are compared with the bytes there are before an array
is made. A buffer is in the file itself or in a file beside the document, never elsewhere. Views may
be compressed (``EXT_meshopt_compression``), numbers quantised (``KHR_mesh_quantization``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import FloatArray, IntArray
from facert.data.memory import FLOAT, FileMemory
from facert.data.version import MARK
from facert.errors import InputError, reading
from facert.io.gltf.compression import MESHOPT, decompressed
from facert.io.gltf.container import read_container
from facert.io.guarded import parsing, read_beginning

MAX_VALUES = 2**27
"""Most numbers of one array: 1 GiB of float64."""

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_DRACO = "KHR_draco_mesh_compression"
_GENERATOR = re.compile(rf'"generator"\s*:\s*"{MARK}'.encode())


@dataclass(frozen=True)
class Document:
    """The JSON of a glTF file, and its buffers.

    Attributes
    ----------
    root : dict
        The JSON, as it stands in the file: keys and types are not checked.
    buffers : sequence of bytes
    memory : FileMemory
    """

    root: dict[str, Any]
    buffers: Sequence[bytes]
    memory: FileMemory = field(default_factory=lambda: FileMemory(0))
    # All that is decoded is counted, however often.
    _unpacked: dict[int, bytes] = field(default_factory=dict)  # compressed views, by number

    def numbers(self, accessor: int) -> FloatArray:
        """An accessor's numbers (count, width) as float64; normalised integers are 0 to 1."""
        described = self.root["accessors"][_index(accessor)]
        values = self._values(described)
        if not described.get("normalized", False) or values.dtype.kind == "f":
            return values.astype(np.float64)
        return np.maximum(values / float(np.iinfo(values.dtype).max), -1.0)

    def integers(self, accessor: int) -> IntArray:
        """An accessor's whole numbers, (count, width)."""
        values = self._values(self.root["accessors"][_index(accessor)])
        if values.dtype.kind != "u":
            raise ValueError("indices that are no unsigned integers")
        return values.astype(np.int64)

    def _values(self, accessor: dict[str, Any]) -> NDArray[Any]:
        width, count = _WIDTHS[accessor["type"]], _index(accessor["count"])
        self.memory.require(FLOAT * count * width, "accessors")
        dtype = _TYPES[accessor["componentType"]]
        if "bufferView" in accessor:
            values = self._view(accessor, dtype, count, width)
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            changed = _index(sparse["count"])
            places = sparse["indices"]
            rows = self._view(places, _TYPES[places["componentType"]], changed, 1)[:, 0]
            values = values.copy()
            values[rows] = self._view(sparse["values"], dtype, changed, width)
        return values

    def _view(self, place: dict[str, Any], dtype: str, count: int, width: int) -> NDArray[Any]:
        """Numbers that lie in a buffer, (count, width)."""
        number, offset = _index(place["bufferView"]), _index(place.get("byteOffset", 0))
        view, content = self.root["bufferViews"][number], self.content(number)
        size = np.dtype(dtype).itemsize
        stride = _index(view.get("byteStride", 0)) or width * size
        # Not left to NumPy, which takes an empty buffer to be as large as it needs to be.
        if count and offset + (count - 1) * stride + width * size > len(content):
            raise ValueError(f"{count} numbers in {len(content)} bytes")
        return np.ndarray((count, width), dtype, content, offset, (stride, size))

    def content(self, number: int) -> bytes:
        """The bytes of a view, decompressed."""
        view = self.root["bufferViews"][number]
        packed = next(filter(None, map(view.get("extensions", {}).get, MESHOPT)), None)
        if packed is None:
            return self._bytes(view)
        if number not in self._unpacked:
            length = _index(view["byteLength"])
            self.memory.require(length, "bufferViews")
            self._unpacked[number] = decompressed(packed, self._bytes(packed), length)
        return self._unpacked[number]

    def _bytes(self, place: dict[str, Any]) -> bytes:
        begin = _index(place.get("byteOffset", 0))
        return self.buffers[_index(place["buffer"])][begin : begin + _index(place["byteLength"])]


@contextmanager
def open_gltf(path: Path) -> Iterator[Document]:
    """Read a foreign glTF file; whatever goes wrong inside the block is blamed on it.

    Raises `InputError` when the file is missing, too large, cut short, compressed, or no glTF 2.0.
    """
    path = Path(path)
    # What overflows is found where rigs and takes are checked.
    with reading(path), parsing("file", "valid glTF 2.0"), np.errstate(all="ignore"):
        yield _document(path)


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a glTF file, by its generator, which stands near the beginning."""
    return _GENERATOR.search(read_beginning(path)) is not None


def _document(path: Path) -> Document:
    container = read_container(path)
    if _needs_draco(container.root):
        fix = "Export it without Compression, or: npx gltf-pipeline -i IN.glb -o PLAIN.glb"
        raise InputError("extensionsRequired", "no Draco compression", _DRACO, fix)
    return Document(container.root, container.buffers(), container.memory)


def _needs_draco(root: dict[str, Any]) -> bool:
    """Whether the file says so, or has no plain positions beside the compressed ones."""
    packed = (
        one["attributes"]["POSITION"]
        for mesh in root.get("meshes", [])
        for one in mesh["primitives"]
        if _DRACO in one.get("extensions", {})
    )
    return _DRACO in root.get("extensionsRequired", []) or any(
        "bufferView" not in root["accessors"][_index(accessor)] for accessor in packed
    )


def _index(value: Any) -> int:
    """Check that a number is a count or an index: an integer, not below 0."""
    if type(value) is not int or value < 0:
        raise ValueError(f"{value!r} where a whole number from 0 on is due")
    return value
