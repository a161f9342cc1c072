"""The guarded door for foreign files: existing, not too large; damage is the file's fault."""

from __future__ import annotations

import codecs
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from facert.errors import InputError

log = logging.getLogger("facert")

MAX_BYTES = 2**29
"""Largest file that is read as a whole: half a gibibyte."""


def existing_file(path: Path) -> Path:
    """Check that `path` is a file that may be read.

    Raises `InputError` when there is nothing, a folder, or a file without permission.
    """
    if not (path.is_file() and os.access(path, os.R_OK)):
        found = "a folder" if path.is_dir() else "no permission" if path.exists() else "nothing"
        raise InputError("file", "an existing file", found, "Check the name.", where=str(path))
    return path


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

    Raises `InputError` when the file is missing, too large or neither.
    """
    try:
        return moderate_file(path).read_text(encoding=encoding_of(path))
    except (UnicodeError, OSError) as error:
        found, fix = "something else", "Save it as UTF-8."
        raise InputError("file", "UTF-8 text that can be read", found, fix) from error


def read_old_text(path: Path) -> str:
    """Read a text file whose writer may be older than UTF-8: UTF-16 with its mark, or Latin-1.

    Raises `InputError` when the file is missing or too large, or UTF-16 without sense.
    """
    content = moderate_file(path).read_bytes()
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        with parsing("file", "UTF-16 text", "Save it as UTF-8."):
            return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        log.info("%s: no UTF-8, read as Latin-1 (Windows-1252)", path.name)
        return content.decode("cp1252", errors="replace")


@contextmanager
def parsing(
    field: str, expected: str, fix: str = "Export it again.", found: str = "damaged data"
) -> Iterator[None]:
    """An error about the file for whatever goes wrong in the block, where its bytes get a meaning.

    Hostile bytes raise struct.error, KeyError, OverflowError and more, which nobody can list.

    Raises `InputError` instead of any other exception.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        raise InputError(field, expected, f"{found} ({error})", fix) from error
