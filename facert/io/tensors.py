"""Named float64 arrays with JSON metadata in a safetensors file: models and checkpoints.

A model file comes from elsewhere as often as not. It is never unpickled; its header is measured
before it is parsed, and what it declares is compared with the size of the file before it is read.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from facert.data.arrays import FloatArray
from facert.errors import InputError, reading
from facert.io.atomic import write_bytes
from facert.io.guarded import moderate_file, read_beginning

MAX_HEADER = 16 << 20  # bytes
MAX_FILE = 4 << 30
MAX_TENSORS = 256
_KEY = "facert"  # safetensors metadata maps strings to strings; ours is one JSON document
_BEGINNING = f'{{"__metadata__":{{"{_KEY}":'.encode()  # metadata come first


def write_tensors(
    path: Path,
    arrays: Mapping[str, FloatArray],
    metadata: Mapping[str, Any],
    overwrite: bool = False,
) -> None:
    """Write arrays and metadata to a new file, complete or not at all.

    Raises `OutputExistsError` when the file exists and `overwrite` is false.
    """
    contiguous = {
        name: np.ascontiguousarray(array, dtype=np.float64) for name, array in arrays.items()
    }
    # Not save_file: it makes the file readable by its owner alone, whatever the umask.
    content = save(contiguous, {_KEY: json.dumps(metadata, sort_keys=True)})
    write_bytes(content, path, overwrite)


def read_tensors(path: Path, expected: str) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Arrays and metadata of a file written by `write_tensors`.

    `expected` is the metadata's ``format``, e.g. ``"facert-model"``.

    Raises `InputError` when the file is missing, is no safetensors file, is truncated, holds
    anything but finite float64 arrays, or was written in another format or a newer version.
    """
    with reading(path):
        content = _read_checked(path)
        try:
            arrays = load(content)
            header = json.loads(content[8 : 8 + _header_length(content)])
        except (SafetensorError, ValueError, KeyError) as error:
            raise _damaged("the header", "a valid safetensors header", str(error)) from None
        metadata = _metadata(header, expected)
        for name, array in arrays.items():
            if array.dtype != np.float64 or not np.isfinite(array).all():
                raise _damaged(name, "finite float64 numbers", f"{array.dtype}, or NaN")
        return arrays, metadata


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a safetensors file, by its metadata."""
    return read_beginning(path)[8:].startswith(_BEGINNING)


def _read_checked(path: Path) -> bytes:
    content = moderate_file(path, MAX_FILE).read_bytes()
    length = _header_length(content)
    if length > min(MAX_HEADER, len(content) - 8) or content[8:9] != b"{":
        raise _damaged("the header", "a safetensors file", "something else or a truncated file")
    return content


def _header_length(content: bytes) -> int:
    if len(content) < 8:
        return MAX_FILE
    (length,) = struct.unpack("<Q", content[:8])
    return int(length)


def _metadata(header: Any, expected: str) -> dict[str, Any]:
    try:
        metadata = json.loads(header["__metadata__"][_KEY])
        found, version = metadata["format"], metadata["format_version"]
    except (KeyError, TypeError, ValueError, RecursionError):
        raise _damaged("the metadata", f"a {expected} file", "no facert metadata") from None
    if found != expected:
        raise InputError("format", expected, repr(found), f"Give a {expected} file.")
    if version != 1:
        raise InputError("format_version", "1", repr(version), "Update facert.")
    if len(header) > MAX_TENSORS:
        raise _damaged("the header", f"at most {MAX_TENSORS} arrays", f"{len(header)}")
    if not isinstance(metadata, dict):
        raise _damaged("the metadata", "a JSON object", type(metadata).__name__)
    return metadata


def _damaged(field: str, expected: str, found: str) -> InputError:
    return InputError(field, expected, found, "Train the model again, or give another file.")
