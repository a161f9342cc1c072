"""The bytes of a GLB file in the making, and the file itself."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facert.data.arrays import FloatArray, IntArray, single_precision
from facert.errors import InputError
from facert.io.atomic import writing
from facert.io.gltf.container import BINARY, JSON, MAGIC

_TYPES = {np.dtype("<f4"): 5126, np.dtype("<u4"): 5125}
_WIDTHS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_VERTICES, _INDICES = 34962, 34963
_LARGEST = 2**32 - 1


class Buffer:
    """The bytes of a file in the making, and their description in the JSON.

    Parameters
    ----------
    views, accessors : list of dict, optional
        The description of what there is already: what is added comes after it.
    """

    def __init__(
        self,
        views: list[dict[str, Any]] | None = None,
        accessors: list[dict[str, Any]] | None = None,
    ) -> None:
        self.parts: list[bytes] = []
        self.size = 0
        self.views = [] if views is None else views
        self.accessors = [] if accessors is None else accessors

    def append(self, content: bytes) -> int:
        """Append bytes, and a few zeros, so that all stays aligned; return where they begin."""
        begin, padding = self.size, b"\0" * (-len(content) % 4)
        self.parts += [content, padding] if padding else [content]
        self.size += len(content) + len(padding)
        return begin

    def view(self, content: bytes, **described: int) -> int:
        """Append bytes; return the number of their view."""
        place = {"buffer": 0, "byteOffset": self.append(content), "byteLength": len(content)}
        self.views.append(place | described)
        return len(self.views) - 1

    def add(self, array: NDArray[Any], use: int | None = None) -> int:
        """Append an array (n,) or (n, 3) or (n, 4); return the number of its accessor."""
        accessor = {
            "bufferView": self.view(array.tobytes(), **({"target": use} if use else {})),
            "componentType": _TYPES[array.dtype],
            "count": len(array),
            "type": _WIDTHS[1 if array.ndim == 1 else array.shape[1]],
            "min": np.atleast_1d(array.min(axis=0)).tolist(),
            "max": np.atleast_1d(array.max(axis=0)).tolist(),
        }
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def vertices(self, values: FloatArray) -> int:
        """Append something of every vertex, (V, 3)."""
        return self.add(single_precision(values, "vertices"), _VERTICES)

    def keys(self, values: FloatArray) -> int:
        """Append numbers of an animation: vectors (T, 3) or (T, 4), or others (T,)."""
        return self.add(single_precision(values, "keys"))

    def corners(self, faces: IntArray) -> int:
        """Append triangles (F, 3)."""
        return self.add(faces.astype("<u4").ravel(), _INDICES)


def write_container(
    root: dict[str, Any], buffer: Buffer, path: Path, overwrite: bool, others: bytes = b""
) -> None:
    """Write a GLB file of this JSON, these bytes, and chunks that follow them as they are.

    Of the JSON's buffers the first is the file's own chunk: its size is put in.

    Raises `InputError` when it would exceed 4 GiB, as much as GLB can hold, and `OutputExistsError`
    when `path` exists and `overwrite` is not set.
    """
    described = [{"byteLength": buffer.size}, *root.get("buffers", [])[1:]] if buffer.size else []
    lists = {"accessors": buffer.accessors, "bufferViews": buffer.views, "buffers": described}
    root = root | {key: value for key, value in lists.items() if value}
    text = json.dumps(root, separators=(",", ":"), ensure_ascii=True).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + buffer.size + len(others)
    if total > _LARGEST:
        fix = "Choose fewer frames, or a larger tolerance."
        raise InputError("output", "at most 4 GiB", f"{total} bytes", fix, str(path))
    with writing(path, overwrite) as file:
        file.write(struct.pack("<III", MAGIC, 2, total))
        file.write(struct.pack("<II", len(text), JSON) + text)
        file.write(struct.pack("<II", buffer.size, BINARY))
        for part in (*buffer.parts, others):
            file.write(part)
