"""Compressed views of glTF buffers: ``EXT_meshopt_compression`` and its successor ``KHR_``.

The library meshopt decodes them in C++; what a file declares is compared with the bytes that it has
before memory is taken for it.
"""

from __future__ import annotations

from typing import Any

from facert.io.guarded import MAX_BYTES

MESHOPT = ("KHR_meshopt_compression", "EXT_meshopt_compression")
"""Names of the extension, of a view and of a buffer that is left out."""

_MOST = {"ATTRIBUTES": 1024, "TRIANGLES": 3, "INDICES": 1}
"""At most so many bytes of attributes, or so many indices, come out of one compressed byte."""


def decompressed(packed: dict[str, Any], content: bytes, length: int) -> bytes:
    """The bytes of a view, of that length, out of compressed ones that the extension describes.

    Raises `ValueError` for damaged bytes, or counts that such bytes cannot hold.
    """
    import meshopt

    count, size, mode = packed["count"], packed["byteStride"], packed["mode"]
    if type(count) is not int or type(size) is not int or not 0 < size <= 256:
        raise ValueError("compressed data of no size")
    items = count * size if mode == "ATTRIBUTES" else count
    if not 0 < count * size <= min(length, MAX_BYTES) or items > _MOST[mode] * len(content):
        raise ValueError(f"{count} items of {size} bytes in {len(content)} compressed bytes")
    rows = meshopt.decode_gltf_buffer(content, count, size, mode, packed.get("filter"))
    return bytes(rows.tobytes())
