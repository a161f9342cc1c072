"""Inputs of fuzzing, and the files that are put together from them.

A reader of a container looks at sizes and checksums first: bytes that are changed at random end
there. So the fuzzer changes the parts of a container, and the container is made around them.
"""

from __future__ import annotations

import json
import struct
import warnings
import zipfile
from collections.abc import Callable
from io import BytesIO
from typing import NamedTuple

BORDER = b"\x00\xffPART\xff\x00"
"""Stands between the parts of an input."""
_EDIT = struct.Struct("<IB")


class Pieces(NamedTuple):
    """How the file of an input is put together, and an input taken from a valid file."""

    join: Callable[[bytes], bytes]
    split: Callable[[bytes], bytes]


def _as_it_is(data: bytes) -> bytes:
    return data


def _join_glb(data: bytes) -> bytes:
    """A GLB of a JSON text and, after the border, a binary chunk."""
    text, _, body = data.partition(BORDER)
    chunks = b""
    for kind, content in ((b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", body)):
        chunks += struct.pack("<I", len(content)) + kind + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _split_glb(file: bytes) -> bytes:
    (length,) = struct.unpack_from("<I", file, 12)
    return file[20 : 20 + length] + BORDER + file[20 + length + 8 :]


def _join_zip(data: bytes) -> bytes:
    """A ZIP archive, packed, of names and contents by turns."""
    parts = data.split(BORDER)
    file = BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        warnings.simplefilter("ignore")  # of names that are there twice
        for index, (name, content) in enumerate(zip(parts[::2], parts[1::2], strict=False)):
            entry = zipfile.ZipInfo(f"{index}.npy")
            entry.filename = name.decode("latin-1")  # also what ZipInfo would tidy
            archive.writestr(entry, content)
    return file.getvalue()


def _split_zip(file: bytes) -> bytes:
    with zipfile.ZipFile(BytesIO(file)) as archive:
        parts = [
            part for name in archive.namelist() for part in (name.encode(), archive.read(name))
        ]
    return BORDER.join(parts)


def _join_tensors(data: bytes) -> bytes:
    """A safetensors file of a header and, after the border, the tensors."""
    header, _, body = data.partition(BORDER)
    return struct.pack("<Q", len(header)) + header + body


def _split_tensors(file: bytes) -> bytes:
    (length,) = struct.unpack_from("<Q", file)
    return file[8 : 8 + length] + BORDER + file[8 + length :]


def _join_metadata(data: bytes) -> bytes:
    """A model file: facert's metadata, then the header without them, then the tensors."""
    metadata, _, rest = data.partition(BORDER)
    header, _, body = rest.partition(BORDER)
    quoted = json.dumps(metadata.decode("latin-1")).encode()
    return _join_tensors(b'{"__metadata__":{"facert":' + quoted + b"}," + header + BORDER + body)


def _split_metadata(file: bytes) -> bytes:
    header, _, body = _split_tensors(file).partition(BORDER)
    document = json.loads(header)
    metadata = document.pop("__metadata__")["facert"].encode("latin-1", errors="replace")
    return BORDER.join((metadata, json.dumps(document).encode()[1:], body))


def edits_of(original: bytes) -> Pieces:
    """An input is a list of edits of a valid file: a place and the byte there."""

    def join(data: bytes) -> bytes:
        file = bytearray(original)
        for place, value in _EDIT.iter_unpack(data[: len(data) // _EDIT.size * _EDIT.size]):
            file[place % len(file)] = value
        return bytes(file)

    return Pieces(join, lambda file: _EDIT.pack(0, file[0]))


PLAIN = Pieces(_as_it_is, _as_it_is)
GLB = Pieces(_join_glb, _split_glb)
ZIP = Pieces(_join_zip, _split_zip)
TENSORS = Pieces(_join_tensors, _split_tensors)
METADATA = Pieces(_join_metadata, _split_metadata)
