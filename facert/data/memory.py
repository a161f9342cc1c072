"""The limit of memory: what one file, or one computation, may take.

A file of a few bytes can declare arrays of gibibytes, and some computations take memory with the
square of what they are given. Whoever allocates by what a file says asks here first: `FileMemory`
counts up what one file takes, `require_memory` looks at one computation.
"""

from __future__ import annotations

import os
import re
from functools import cached_property
from pathlib import Path

from facert.data.free_memory import free_memory
from facert.errors import InputError

OPTION, VARIABLE = "--max-memory", "FACERT_MAX_MEMORY"
FACTOR = 100
"""Bytes that each byte of a file may take, by default."""
LEAST = 64 << 20
"""What a small file may take, so that one whose content repeats can be packed well."""
MOST = 2 << 30
"""What a file or a computation may take, by default."""
OUT_OF_MEMORY = (
    "there is not enough memory. Close other programs, use fewer --jobs, or cut the file into parts"
)
"""What the command line says to a `MemoryError`."""

FLOAT = 8  # bytes of a number in an array
CELL = 100
"""Bytes of a cell of text, or of a value in a JSON document, as a Python object in a list."""

_UNITS = {"": 0, "k": 10, "m": 20, "g": 30, "t": 40}
_SIZE = re.compile(r"\s*(\d{1,20}(?:\.\d{0,20})?)\s*([kmgt]?)(?:i?b)?\s*", re.IGNORECASE)
_sharing = 1  # processes of this run; each may take its part of what is free


def share_memory(processes: int) -> None:
    """Let this process take its part of the free memory, as so many work at once."""
    global _sharing
    _sharing = max(1, processes)


def set_max_memory(size: str | None) -> None:
    """Set the limit for this process and those that it starts; None keeps what is set.

    Raises `InputError` when `size` is not a number of bytes, such as ``500M`` or ``4G``.
    """
    if size is not None:
        os.environ[VARIABLE] = str(parsed_size(size, OPTION))


def max_memory() -> int | None:
    """The limit that the user set, in bytes; None where it goes by the file.

    Raises `InputError` when the environment's variable is no size.
    """
    given = os.environ.get(VARIABLE)
    return parsed_size(given, VARIABLE) if given else None


def parsed_size(text: str, field: str) -> int:
    """A number of bytes with or without its unit, each 1024 of the one before.

    >>> parsed_size("64M", "--max-memory"), parsed_size("1.5 GiB", "--max-memory")
    (67108864, 1610612736)
    """
    match = _SIZE.fullmatch(text)
    size = int(float(match[1]) * 2 ** _UNITS[match[2].lower()]) if match else 0
    if not size:
        raise InputError(field, "a size such as 500M or 4G", repr(text), "Write such a size.")
    return size


class FileMemory:
    """What one file takes of the memory: each part is counted before it is allocated.

    Parameters
    ----------
    path : Path or int
        The file, or its size in bytes.
    """

    def __init__(self, path: Path | int) -> None:
        self._size = self.taken = 0
        self.include(path)

    def include(self, path: Path | int) -> None:
        """Count another file as a part of this one, which may take more by that."""
        self._size += path if isinstance(path, int) else path.stat().st_size
        self._limit = _Limit(min(max(FACTOR * self._size, LEAST), MOST))

    def require(self, size: int, field: str) -> None:
        """Count `size` bytes more.

        Raises `InputError` that names the field when the file takes more than it may.
        """
        self._limit.require(self.taken + size, field)
        self.taken += size


def require_memory(size: int, field: str, fix: str = "") -> None:
    """Refuse a computation that would take more than `MOST`, the user's limit, or what is free.

    `fix` is what helps, beside a higher limit.

    Raises `InputError` that names the field.
    """
    _Limit(MOST).require(size, field, fix)


def require_square(count: int, field: str, fix: str = "", copies: int = 4) -> None:
    """Refuse a computation with matrices of `count` rows and columns that would not fit.

    Raises `InputError` that names the field, as `require_memory` does.
    """
    require_memory(copies * FLOAT * count**2, f"{field} ({count})", fix)


def readable(size: int) -> str:
    """A number of bytes for people.

    >>> readable(1536 << 20), readable(100)
    ('1.5 GiB', '100 bytes')
    """
    for unit, bits in (("TiB", 40), ("GiB", 30), ("MiB", 20), ("KiB", 10)):
        if size >= 1 << bits:
            return f"{size / (1 << bits):.3g} {unit}"
    return f"{size} bytes"


class _Limit:
    """The least of what is right by default, or what the user set, and of what is free."""

    def __init__(self, default: int) -> None:
        self._allowed = max_memory() or default

    @cached_property
    def _free(self) -> int:
        free = free_memory()
        return self._allowed if free is None else free // _sharing

    def require(self, size: int, field: str, fix: str = "") -> None:
        if size <= min(self._allowed, LEAST // 8):
            return  # to ask the system what is free takes longer than what is as small
        if size <= min(self._allowed, self._free):
            return
        if self._free < self._allowed:
            expected = f"at most {readable(self._free)} of memory, which is free"
            advice = "Close other programs, or use a machine with more."
        else:
            expected = f"at most {readable(self._allowed)} of memory"
            advice = f"If the file can be trusted, allow more with {OPTION}."
        raise InputError(field, expected, readable(size), f"{fix} {advice}".lstrip())
