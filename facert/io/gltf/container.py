"""What a glTF file is made of: JSON, and bytes in its own chunk, in the JSON, or in files beside.

A GLB file is a header, a chunk of JSON, a chunk of bytes, and maybe chunks that nobody knows.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from facert.data.memory import CELL, FileMemory
from facert.errors import InputError
from facert.io.curves import parse_json_object
from facert.io.gltf.compression import MESHOPT
from facert.io.gltf.uris import data_of, file_of
from facert.io.guarded import JSON_SEPARATORS, moderate_file, read_beginning, read_text, values_in

MAGIC, JSON, BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942
MAX_VALUES = 2**20
"""Most values of the JSON: of a whole character there are 100,000."""
MOST = {"nodes": 2**15, "children": 2**15, "meshes": 2**12, "channels": 2**15}
"""Most nodes, nodes below others, parts of meshes that nodes show, and channels of animations."""


@dataclass(frozen=True, eq=False)
class Container:
    """The parts of a glTF file."""

    root: dict[str, Any]
    """The JSON, as it stands in the file: keys and types are not checked."""
    path: Path
    own: bytes | None = None
    """The chunk of bytes of a GLB file."""
    others: bytes = b""
    """All chunks that follow it, as they are."""
    memory: FileMemory = field(default_factory=lambda: FileMemory(0))
    """What the file takes, with the files beside it; whoever decodes counts on it."""

    def buffers(self) -> list[bytes]:
        """The bytes of each buffer.

        Raises `InputError` for one that is neither in the file nor beside it.
        """
        found: dict[str, bytes] = {}  # several may name the same
        buffers = []
        for number, one in enumerate(self.root.get("buffers", [])):
            uri = one.get("uri")
            if is_left_out(one):
                buffers.append(b"")
            elif uri is None and number == 0 and self.own is not None:
                buffers.append(self.own)
            else:
                if uri not in found:
                    found[uri] = self._content(uri)
                buffers.append(found[uri])
        return buffers

    def _content(self, uri: Any) -> bytes:
        """The bytes in a data URI, or of a file beside the document."""
        embedded = data_of(uri) if isinstance(uri, str) else None
        if embedded is not None:
            return embedded
        file = moderate_file(file_of(uri, self.path, "buffers"))
        self.memory.include(file)
        self.memory.require(file.stat().st_size, "buffers")
        return file.read_bytes()


def read_container(path: Path) -> Container:
    """The parts of a file; what is wrong with them raises whatever it likes, see `parsing`."""
    memory = FileMemory(moderate_file(path))
    text: str | bytes
    if read_beginning(path, 4) == struct.pack("<I", MAGIC):
        memory.require(path.stat().st_size, "file")
        text, own, others = _chunks(path.read_bytes())
    else:
        text, own, others = read_text(path).encode(), None, b""
    values = values_in(text, JSON_SEPARATORS)  # lines and tabs, as Blender indents, are none
    _require_count("values of the JSON", values, MAX_VALUES)
    memory.require(CELL * values, "JSON")
    root = parse_json_object(text)
    for name, count in _counts(root).items():
        _require_count(name, count, MOST[name])
    if not str(root["asset"]["version"]).startswith("2"):
        raise InputError("asset version", "2.0", repr(root["asset"]), "Export it as glTF 2.0.")
    return Container(root, path, own, others, memory)


def _counts(root: dict[str, Any]) -> dict[str, int]:
    """How many there are of what each takes its time."""
    nodes, meshes = root.get("nodes", []), root.get("meshes", [])
    sizes = [len(mesh["primitives"]) for mesh in meshes]
    return {
        "nodes": len(nodes),
        "children": sum(len(node.get("children", [])) for node in nodes),
        "meshes": sum(sizes[node["mesh"]] for node in nodes if "mesh" in node),
        "channels": sum(len(one["channels"]) for one in root.get("animations", [])),
    }


def _require_count(name: str, count: int, most: int) -> None:
    if count > most:
        fix = "Export the character alone, with the animation that you need."
        raise InputError(name, f"at most {most}", f"{count}", fix)


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
