"""Output files appear whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from facert.errors import InputError
from facert.io.registry import require_replaceable


@contextmanager
def replacing(path: Path, overwrite: bool = False) -> Iterator[Path]:
    """Write under a temporary name in the same folder; rename when all went well.

    Parameters
    ----------
    path : Path
        The output file. Missing parent folders are made.
    overwrite : bool
        Allow to replace an existing file that facert wrote.

    Yields
    ------
    Path
        The temporary name, with the same ending; write, and close, the file there.

    Raises
    ------
    OutputExistsError
        When `path` exists and `overwrite` is not set; raised before anything is written.
    OutputKeptError
        When facert did not write the file that is there; see `require_replaceable`.
    InputError
        When the file cannot be written there. On this, as on any exception of the writer, no
        temporary file is left and an existing `path` is untouched.
    """
    path = Path(path)
    require_replaceable(path, overwrite)
    temporary = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        _flush(temporary)
        temporary.replace(path)
        _flush(path.parent)
    except OSError as error:
        expected, found = "a name in a folder that can be written to", error.strerror or str(error)
        fix = "Choose another place, or make room there."
        raise InputError("output", expected, found, fix, where=str(path)) from error
    finally:
        with suppress(OSError):  # it may be gone, or its folder may not be there
            temporary.unlink()


def _flush(path: Path) -> None:
    """Make the disk hold what was written; a folder too, so that a rename survives a power cut."""
    if path.is_dir() and os.name == "nt":  # Windows cannot open a folder
        return
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
