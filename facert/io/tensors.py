"""Named float64 arrays with JSON metadata in a safetensors file: models and checkpoints.

A model file comes from elsewhere as often as not. It is never unpickled; its header is measured
before it is parsed, and what it declares is checked before any array is read: the size of the file
against the shapes, the metadata against a dataclass, the shapes by whoever knows what they mean.
"""

from __future__ import annotations

import json
import logging
import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
from safetensors.numpy import save

from facert.data.array_group import Shaped
from facert.data.arrays import FloatArray
from facert.data.memory import FLOAT, FileMemory
from facert.data.text import listed
from facert.data.typed import typed
from facert.data.version import CREATED_BY
from facert.errors import InputError, reading
from facert.io.atomic import NewBytes, replacing
from facert.io.guarded import existing_file, parsing, read_beginning
from facert.io.plain_json import parse_json

log = logging.getLogger("facert")

MAX_HEADER = 16 << 20  # bytes
MAX_TENSORS = 256
FIX = "Train the model again, or give another file."
VERSION = 1
_KEY = "facert"  # safetensors metadata maps strings to strings; ours is one JSON document
_BEGINNING = f'{{"__metadata__":{{"{_KEY}":'.encode()  # metadata come first
_LENGTH = struct.Struct("<Q")

Kind = TypeVar("Kind")


@dataclass(frozen=True)
class Declared:
    """An array as a header declares it."""

    dtype: str
    shape: tuple[int, ...]
    data_offsets: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of elements."""
        return math.prod(self.shape)


def write_tensors(
    path: Path,
    arrays: Mapping[str, FloatArray],
    metadata: Any,
    format_name: str,
    overwrite: bool = False,
    check: Callable[[Path], None] | None = None,
) -> None:
    """Write arrays and metadata to a new file, complete or not at all.

    Parameters
    ----------
    path : Path
    arrays : mapping
        Arrays by their names.
    metadata : dataclass
        Of plain values.
    format_name : str
        What `read_tensors` is to expect, e.g. ``"facert-model"``.
    overwrite : bool
        Replace an existing file.
    check : callable, optional
        Looks at the new file before it takes its place; what it raises leaves all as it was.

    Raises
    ------
    OutputExistsError
        When the file exists and `overwrite` is false.
    """
    contiguous = {
        name: np.ascontiguousarray(array, dtype=np.float64) for name, array in arrays.items()
    }
    head = {"format": format_name, "format_version": VERSION, "created_by": CREATED_BY}
    document = json.dumps(head | asdict(metadata), sort_keys=True, allow_nan=False)
    if len(document) > MAX_HEADER:
        raise _damaged("the header", f"at most {MAX_HEADER} bytes", f"{len(document)}")
    with replacing(path, overwrite) as temporary:
        with NewBytes(temporary, "x") as file:
            # Not save_file: it makes the file readable by its owner alone, whatever the umask. Not
            # kept, as a check takes as much again.
            file.write(save(contiguous, {_KEY: document}))
        if check is not None:
            check(temporary)


def read_tensors(
    path: Path,
    expected: str,
    kind: type[Kind],
    check: Callable[[Mapping[str, Shaped], Kind], None],
) -> tuple[dict[str, FloatArray], Kind]:
    """Arrays and metadata of a file written by `write_tensors`.

    Parameters
    ----------
    path : Path
    expected : str
        The metadata's ``format``, e.g. ``"facert-model"``.
    kind : type
        The dataclass of the metadata; what else is there is passed over, with a warning.
    check : callable
        Takes what the header declares of each array, and the metadata; raises `InputError` when
        they do not fit together. No array has been read by then.

    Raises
    ------
    InputError
        When the file is missing, is no safetensors file, is truncated, holds anything but finite
        float64 arrays, or was written in another format or a newer version.
    """
    with reading(path), existing_file(path).open("rb") as file:
        size = path.stat().st_size
        length, header = _header(file, size)
        metadata = _metadata(path, header.pop("__metadata__", None), expected, kind)
        if len(header) > MAX_TENSORS:
            raise _damaged("the header", f"at most {MAX_TENSORS} arrays", f"{len(header)}")
        declared = {name: _declared(name, entry) for name, entry in header.items()}
        content = FLOAT * sum(one.size for one in declared.values())
        if _LENGTH.size + length + content != size:
            expected = f"a file of {_LENGTH.size + length + content} bytes"
            raise _damaged("the header", expected, f"{size} bytes")
        check(declared, metadata)
        FileMemory(path).require(content, "the arrays")
        arrays = _arrays(file, declared)
        for name, array in arrays.items():
            if not np.isfinite(array).all():
                raise _damaged(name, "finite float64 numbers", "NaN or infinity")
        return arrays, metadata


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a safetensors file, by its metadata."""
    return read_beginning(path)[8:].startswith(_BEGINNING)


def _header(file: BinaryIO, size: int) -> tuple[int, dict[str, Any]]:
    """Length of a header in bytes, and what it says."""
    beginning = file.read(_LENGTH.size + 1)
    length = _LENGTH.unpack_from(beginning)[0] if len(beginning) > _LENGTH.size else size
    if length > min(MAX_HEADER, size - _LENGTH.size) or beginning[-1:] != b"{":
        raise _damaged("the header", "a safetensors file", "something else or a truncated file")
    file.seek(_LENGTH.size)
    with parsing("the header", "a valid safetensors header", FIX):
        header: dict[str, Any] = parse_json(file.read(length).decode())
    return length, header


def _arrays(file: BinaryIO, declared: Mapping[str, Declared]) -> dict[str, FloatArray]:
    """The arrays behind the header, read one after the other: there is no copy of them all."""
    arrays, end = {}, 0
    for name, one in sorted(declared.items(), key=lambda item: item[1].data_offsets):
        if one.data_offsets != (end, end + FLOAT * one.size):
            expected = f"data_offsets [{end}, {end + FLOAT * one.size}]"
            raise _damaged(name, expected, f"{list(one.data_offsets)}")
        end = one.data_offsets[1]
        with parsing(name, "an array of float64", FIX):
            arrays[name] = np.fromfile(file, "<f8", one.size).reshape(one.shape)
    return arrays


def _metadata(path: Path, entry: object, expected: str, kind: type[Kind]) -> Kind:
    try:
        document = parse_json(entry[_KEY])  # type: ignore[index]  # what is no mapping raises
        found, version = document.pop("format"), document.pop("format_version")
    except (KeyError, TypeError, ValueError, AttributeError):
        raise _damaged("the metadata", f"a {expected} file", "no facert metadata") from None
    if found != expected:
        raise InputError("format", expected, f"{found!r:.60}", f"Give a {expected} file.")
    if version != VERSION:
        raise InputError("format_version", f"{VERSION}", f"{version!r:.60}", "Update facert.")
    known = {field.name for field in fields(kind)}  # type: ignore[arg-type]  # a dataclass
    unknown = sorted(document.keys() - known - {"created_by"})
    if unknown:
        log.warning("%s: passed over, as a newer facert wrote it: %s", path.name, listed(unknown))
    own = {name: value for name, value in document.items() if name in known}
    return typed(kind, own, "the metadata", FIX)


def _declared(name: str, entry: object) -> Declared:
    found = typed(Declared, entry, name, FIX)
    if found.dtype != "F64" or any(size < 0 for size in found.shape):
        raise _damaged(name, "finite float64 numbers", f"{found.dtype} {found.shape}")
    return found


def _damaged(field: str, expected: str, found: str) -> InputError:
    return InputError(field, expected, found, FIX)
