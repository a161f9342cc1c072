"""What a glTF file is made of: JSON, and bytes in its own chunk, in the JSON, or in files beside.

A GLB file is a header, a chunk of JSON, a chunk of bytes, and maybe chunks that nobody knows.
"""

from __future__ import annotations

import base64
import binascii
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from facert.errors import InputError
from facert.io.curves import parse_json_object
from facert.io.gltf.compression import MESHOPT
from facert.io.guarded import moderate_file

MAGIC, JSON, BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942
_EMBEDDED = ";base64,"


@dataclass(frozen=True, eq=False)
class Container:
    """The parts of a glTF file."""

    root: dict[str, Any]
    """The JSON, as it stands in the file: keys and types are not checked."""
    folder: Path
    own: bytes | None = None
    """The chunk of bytes of a GLB file."""
    others: bytes = b""
    """All chunks that follow it, as they are."""

    def buffers(self) -> list[bytes]:
        """The bytes of each buffer.

        Raises `InputError` for one that is neither in the file nor beside it.
        """
        described = enumerate(self.root.get("buffers", []))
        return [_buffer(one, self.folder, self.own, number) for number, one in described]


def read_container(path: Path) -> Container:
    """The parts of a file; what is wrong with them raises whatever it likes, see `parsing`."""
    content = moderate_file(path).read_bytes()
    binary = content[:4] == struct.pack("<I", MAGIC)
    text, own, others = _chunks(content) if binary else (content, None, b"")
    root = parse_json_object(text)
    if not str(root["asset"]["version"]).startswith("2"):
        raise InputError("asset version", "2.0", repr(root["asset"]), "Export it as glTF 2.0.")
    return Container(root, path.parent, own, others)


def data_of(uri: str) -> bytes | None:
    """The bytes in a data URI; None for another one."""
    if not uri.startswith("data:") or _EMBEDDED not in uri:
        return None
    try:
        return base64.b64decode(uri.partition(_EMBEDDED)[2], validate=True)
    except binascii.Error as error:
        raise ValueError(f"a buffer: {error}") from error


def is_left_out(buffer: dict[str, Any]) -> bool:
    """Whether a buffer is for programs that cannot decompress, so that it may be absent."""
    return any(name in buffer.get("extensions", {}) for name in MESHOPT)


def _chunks(content: bytes) -> tuple[bytes, bytes | None, bytes]:
    """The JSON of a GLB file, its chunk of bytes, and all chunks after it."""
    try:
        _, version, total, length, kind = struct.unpack_from("<IIIII", content)
        rest = content[20 + length : total]
        if version != 2 or kind != JSON or total > len(content) or 20 + length > total:
            raise ValueError
        size, other = struct.unpack_from("<II", rest) if len(rest) >= 8 else (0, 0)
    except (struct.error, ValueError):
        expected, found = "a whole GLB file of version 2", "another or a truncated one"
        raise InputError("file", expected, found, "Export it again.") from None
    text = content[20 : 20 + length]
    return (text, rest[8 : 8 + size], rest[8 + size :]) if other == BINARY else (text, None, rest)


def _buffer(buffer: dict[str, Any], folder: Path, own: bytes | None, number: int) -> bytes:
    """Bytes of a buffer, from the file's own chunk, the URI, or a file beside it."""
    if is_left_out(buffer):
        return b""
    uri = buffer.get("uri")
    if uri is None and number == 0 and own is not None:
        return own
    embedded = data_of(uri) if isinstance(uri, str) else None
    if embedded is not None:
        return embedded
    name = unquote(uri) if isinstance(uri, str) else ""
    if not name or name != Path(name).name or "\\" in name or ":" in name or name == "..":
        raise InputError(
            "buffers", "data in the file or beside it", f"{uri!r}", "Export it as one .glb file."
        )
    return moderate_file(folder / name).read_bytes()
