"""The one door by which files are written: they appear whole or not at all.

What a library writes by itself is given a temporary name (`replacing`); all else goes into a file
that is open (`writing`), or is added to one that grows (`Appended`).
"""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from facert.io.claims import claimed, flush, log, temporary_name, writing_errors
from facert.io.registry import require_replaceable


@contextmanager
def replacing(path: Path, overwrite: bool = False) -> Iterator[Path]:
    """Write under a temporary name in the same folder; rename when all went well.

    Where `path` is a link, the file that it leads to is replaced, and the link stays.

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
        When the file cannot be written there, or another run writes it. On this, as on any
        exception of the writer, no temporary file is left and an existing `path` is untouched.
    """
    path = Path(path)
    require_replaceable(path, overwrite)
    with claimed(path) as place, writing_errors(path):
        if place != path:
            log.info("%s is a link: %s is written", path, place)
        temporary = temporary_name(place, path.suffix)
        try:
            yield temporary
            _keep_permissions(place, temporary)
            flush(temporary)
            require_replaceable(path, overwrite)  # it may have appeared meanwhile
            temporary.replace(place)
            flush(place.parent)
        finally:
            with suppress(OSError):  # it may be gone, or its folder may not be there
                temporary.unlink()


@contextmanager
def writing(path: Path, overwrite: bool = False) -> Iterator[io.FileIO]:
    """A new file of bytes that is open; it gets its name when all went well, see `replacing`.

    It has no buffer of its own: write large parts at once.
    """
    with replacing(path, overwrite) as temporary, NewBytes(temporary, "x+") as file:
        yield file


def write_bytes(content: bytes, path: Path, overwrite: bool = False) -> None:
    """Write a whole file of bytes; raises what `replacing` does."""
    with writing(path, overwrite) as file:
        file.write(content)


def write_text(text: str, path: Path, overwrite: bool = False) -> None:
    """Write a whole file of text in UTF-8, with its ends of lines as they are.

    What has no place in UTF-8, half of a pair of UTF-16, is written as an escape.
    """
    write_bytes(text.encode(errors="backslashreplace"), path, overwrite)


class NewBytes(io.FileIO):
    """A file without a buffer whose `write` writes all or fails: a full disk takes a part first."""

    def write(self, content: object, /) -> int:
        """Write all bytes; their number. Raises OSError when the system does not take them."""
        with memoryview(content).cast("B") as rest:  # type: ignore[arg-type]
            done = 0
            while done < len(rest):
                done += super().write(rest[done:])
            return done


class Appended:
    """An existing file that grows line by line, or row by row, and can be read at any moment.

    What was added is in the system's hands when `add` returns: the death of this process takes
    nothing of it.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self._path = Path(path)
        with writing_errors(self._path):
            self._file = NewBytes(self._path, "a+")

    def add(self, content: bytes, sync: bool = False) -> None:
        """Append bytes as a whole; with `sync` they outlive a power cut as well.

        Raises `InputError` when there is no room for them: then none of them is there.
        """
        with writing_errors(self._path):
            end = os.fstat(self._file.fileno()).st_size
            try:
                self._file.write(content)
                if sync:
                    os.fsync(self._file.fileno())
            except OSError:
                with suppress(OSError):
                    self._file.truncate(end)
                raise

    def content(self) -> bytes:
        """All that the file holds; Windows apart, also when its name is gone."""
        self._file.seek(0)
        return self._file.readall() or b""

    def close(self) -> None:
        """Close the file, which stays."""
        self._file.close()

    def __enter__(self) -> Appended:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _keep_permissions(place: Path, temporary: Path) -> None:
    """Give a new file the permissions of the one that it replaces."""
    with suppress(OSError):
        shutil.copymode(place, temporary)
