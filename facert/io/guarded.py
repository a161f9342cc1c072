"""The guarded door for foreign files: existing, not too large; damage is the file's fault."""

from __future__ import annotations

import codecs
import gc
import logging
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from facert.data.memory import CELL, FileMemory
from facert.errors import FacertError, InputError, reading

log = logging.getLogger("facert")

_WORK = re.compile(
    r"^[.~#]|~$|\.(?:bak|crdownload|download|lock|old|part|partial|swp|temp|tmp)$", re.IGNORECASE
)
MAX_BYTES = 2**29
"""Largest file that is read as a whole: half a gibibyte."""
_COPIES = 3  # of a text are in memory: its bytes, its characters, its lines
JSON_SEPARATORS = (b",", b":", b"[", b"{")
_SEPARATORS = (*JSON_SEPARATORS, b";", b"\t", b"\n")
"""Each is one value more, in tables and in JSON."""
_ZEROS = 2**20
"""Bytes of 0 that a text may have, as one that a power cut ended does; more are a hole."""
_AT_ONCE = 2**22
_DAMAGED = 3
"""Bytes that no text has, of which a text has by damage so many at most."""


@contextmanager
def door(path: Path) -> Iterator[None]:
    """The one door by which the content of a foreign file comes in.

    Python's collector of garbage rests meanwhile: a parser makes millions of objects and no
    garbage among them, through which it would look again and again.

    Raises `InputError` that names the file for whatever goes wrong in it, and is not of the system.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        with reading(path), parsing("file", "content that makes sense"):
            yield
    finally:
        if collects:
            gc.enable()


def existing_file(path: Path) -> Path:
    """Check that `path` is a file that may be read.

    Raises `InputError` when there is nothing, a folder, or a file without permission.
    """
    if not (path.is_file() and os.access(path, os.R_OK)):
        found = "a folder" if path.is_dir() else "nothing"
        if path.exists() and not path.is_dir():
            found = "no permission" if path.is_file() else "a pipe or a device"
        raise InputError("file", "an existing file", found, "Check the name.", where=str(path))
    return path


def files_in(folder: Path) -> list[Path]:
    """The files of a folder by name, without hidden ones and what programs leave while they work.

    Such as ``._take.h5`` of a Mac, ``~$take.csv`` of an office, ``take.h5.part`` of a download; and
    without pipes and devices.
    """
    return sorted(
        path for path in folder.iterdir() if path.is_file() and not _WORK.search(path.name)
    )


def moderate_file(path: Path, most: int = MAX_BYTES) -> Path:
    """Check that `path` is a file that may be read, and holds no more than `most` bytes.

    Raises `InputError` also when it is larger.
    """
    size = existing_file(path).stat().st_size
    if size > most:
        raise InputError("file", f"at most {most} bytes", f"{size}", "Cut it into parts.")
    return path


def read_beginning(path: Path, most: int = 2**12) -> bytes:
    """Read the first bytes of a file, however large it is.

    Raises `InputError` when there is no file that may be read.
    """
    with existing_file(path).open("rb") as file:
        return file.read(most)


def encoding_of(path: Path) -> str:
    """The encoding of a text file by its byte order mark: UTF-16, as Excel writes it, or UTF-8."""
    utf_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    beginning = read_beginning(path, 3)  # a mark alone is no text
    return "utf-16" if len(beginning) > 2 and beginning[:2] in utf_16 else "utf-8-sig"


def read_text(path: Path) -> str:
    """Read a text file of UTF-8, with or without a byte order mark, or of UTF-16 with its mark.

    Raises `InputError` when the file is missing, too large or neither, or when its values would
    take more memory than they may.
    """
    try:
        _require_text(path)
        return path.read_text(encoding=encoding_of(path))
    except UnicodeDecodeError as error:
        raise _no_text(error) from error
    except (UnicodeError, OSError) as error:
        found, fix = "something else", "Save it as UTF-8."
        raise InputError("file", "UTF-8 text that can be read", found, fix) from error


def _no_text(error: UnicodeDecodeError) -> InputError:
    """The error about bytes that are none of their encoding: a few have a place, many have not."""
    field, found, fix = "file", "something else", "Save it as UTF-8."
    content = error.object
    damaged = content.decode(error.encoding, errors="replace").count("\ufffd")
    if damaged <= _DAMAGED:
        line = content.count(b"\n", 0, error.start) + 1
        field, found = f"line {line}", f"the byte 0x{content[error.start]:02x}, which is none"
        fix = "Mend the line or copy the file again; of an old encoding, save it as UTF-8."
    return InputError(field, "UTF-8 text that can be read", found, fix)


def read_old_text(path: Path) -> str:
    """Read a text file whose writer may be older than UTF-8: UTF-16 with its mark, or Latin-1.

    Raises `InputError` when the file is missing or too large, UTF-16 without sense, or when its
    values would take more memory than they may.
    """
    _require_text(path)
    content = path.read_bytes()
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        with parsing("file", "UTF-16 text", "Save it as UTF-8."):
            return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        log.info("%s: no UTF-8, read as Latin-1 (Windows-1252)", path.name)
        return content.decode("cp1252", errors="replace")


def _require_text(path: Path) -> None:
    """Check a text file for holes, and what its values will take, before it is in memory."""
    memory = FileMemory(moderate_file(path))
    memory.require(_COPIES * path.stat().st_size, "file")
    values = zeros = 0
    wide = encoding_of(path) == "utf-16"
    with path.open("rb") as file:
        while content := file.read(_AT_ONCE):
            values += values_in(content)
            zeros += 0 if wide else content.count(0)
            if zeros > _ZEROS:
                raise InputError("file", "text", "a hole of zeros", "Copy it again.")
    memory.require(CELL * values, "file")


def values_in(text: bytes, separators: Sequence[bytes] = _SEPARATORS) -> int:
    """How many values a table or JSON holds at most, about, by what separates them."""
    return sum(map(text.count, separators))


@contextmanager
def parsing(
    field: str, expected: str, fix: str = "Export it again.", found: str = "damaged data"
) -> Iterator[None]:
    """An error about the file for whatever goes wrong in the block, where its bytes get a meaning.

    Hostile bytes raise struct.error, KeyError, OverflowError and more, which nobody can list.

    Raises `InputError` instead of any other exception but facert's own, want of memory, and those
    of the system about a file.
    """
    try:
        yield
    except (FacertError, MemoryError):
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise
        said = str(error) or type(error).__name__
        if isinstance(error, UnicodeError):
            said = "bytes that are no text"
        raise InputError(field, expected, f"{found} ({said})", fix) from error
