"""A generic .npz layout for tracks and rigs.

Tracks: ``markers`` (T, M, 3) with ``marker_names``, or ``positions`` (T, M, 3) with ``names``, or
``weights`` (T, D) with ``weight_names``; ``fps``;
``time`` (T,) in seconds unless the frames are evenly spaced; any number of targets: ``KEY`` (T, P)
with ``KEY_names`` (a plural KEY loses its s: ``units``, ``unit_names``).

Rigs: ``neutral`` (V, 3), ``faces`` (F, 3), and shapes: ``deltas`` (P, V, 3) with ``names``, or any
number of ``KEY_deltas`` with ``KEY_names``.

Arrays are read one by one, after the size that they declare has been compared with what the
archive holds; nothing is ever unpickled.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from facert.data.arrays import FloatArray, IntArray, require_shape
from facert.data.columns import learnable
from facert.data.memory import CELL, FLOAT, FileMemory
from facert.data.rate import nominal_rate, standard_rate
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError, reading
from facert.io.guarded import existing_file, parsing
from facert.io.tables.clock_column import in_seconds

NO_TARGET = ""
"""Asks for the source alone of a file with several targets."""

_SOURCES = {"markers": "marker_names", "positions": "names", "weights": "weight_names"}
_PLAIN = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
_MOST_NAMED = 2**20
_TAIL, _END, _LOCATOR, _LARGE_END = 2**16 + 128, 22, 20, 56
"""Bytes of an archive in which it ends, and of the records there (PKWARE's APPNOTE, 4.3.14-16)."""


class Archive:
    """Reading access to the arrays of one open .npz file."""

    def __init__(self, archive: zipfile.ZipFile, memory: FileMemory) -> None:
        self._archive, self._memory = archive, memory
        members = (name for name in archive.namelist() if name.endswith(".npy"))
        self._keys = dict.fromkeys(name.removesuffix(".npy") for name in members)

    @property
    def keys(self) -> tuple[str, ...]:
        """The names of all arrays."""
        return tuple(self._keys)

    def __contains__(self, key: str) -> bool:
        """Whether there is an array of that name."""
        return key in self._keys

    def numbers(self, key: str) -> FloatArray:
        """Read an array of integers or floats as float64."""
        return self._read(key, "iuf", "numbers").astype(np.float64)

    def integers(self, key: str) -> IntArray:
        """Read an array of integers as int64."""
        return self._read(key, "iu", "integers").astype(np.int64)

    def names(self, key: str) -> tuple[str, ...]:
        """Read an array of strings."""
        names = self._read(key, "U", "strings").ravel()
        with _parsing(key):
            return tuple(str(name) for name in names)

    def number(self, key: str) -> float:
        """Read an array that holds one number."""
        values = self.numbers(key)
        if values.size != 1:
            raise InputError(key, "one number", f"shape {values.shape}", "Store a scalar.")
        return float(values.ravel()[0])

    def _read(self, key: str, kinds: str, expected: str) -> NDArray[Any]:
        if key not in self:
            raise InputError(key, "an array", "nothing", f"Store {key}; see the layout.")
        member = self._archive.getinfo(f"{key}.npy")
        if member.compress_type not in _PLAIN:
            found = f"compression {member.compress_type}"
            raise InputError(key, "a deflated array", found, "Store it anew.")
        with _parsing(key), self._archive.open(member) as stream:
            dtype, count = _declared(stream, member.file_size)
        cell = CELL if dtype.kind == "U" else FLOAT
        self._memory.require(member.file_size + cell * count, key)
        if dtype.kind not in kinds:
            raise InputError(key, expected, f"{dtype}", "Store plain numbers or strings.")
        with _parsing(key), self._archive.open(member) as stream:
            return np.asarray(npy_format.read_array(stream, allow_pickle=False))


def _parsing(key: str) -> AbstractContextManager[None]:
    """An error about the file: NumPy evaluates a header as Python source, trusting its numbers."""
    found = "damaged data, or less than the array declares"
    return parsing(key, "a whole array", "Store it anew.", found)


@contextmanager
def open_archive(path: Path) -> Iterator[Archive]:
    """Open a foreign .npz file; errors raised inside name the file.

    Raises `InputError` when the file is missing or is no .npz archive.
    """
    with reading(path):
        _require_few_members(path)
        with parsing("file", "an .npz archive", "Store it anew.", "something else"):
            file = zipfile.ZipFile(path)
        with file:
            yield Archive(file, FileMemory(path))


def _require_few_members(path: Path) -> None:
    """Check the table of an archive's members before each of them takes its object.

    Raises `InputError` where it is larger than that of any take.
    """
    with existing_file(path).open("rb") as file:
        file.seek(max(path.stat().st_size - _TAIL, 0))
        tail = file.read()
    place = tail.rfind(b"PK\5\6")
    if place < 0 or len(tail) < place + _END:
        return  # no archive, as is said soon
    size = int.from_bytes(tail[place + 12 : place + 16], "little")
    if tail[place - _LOCATOR : place].startswith(b"PK\6\7"):  # of an archive of many gibibytes
        record = tail[place - _LOCATOR - _LARGE_END : place - _LOCATOR]
        size = int.from_bytes(record[40:48], "little")
    if size > _MOST_NAMED:
        expected, fix = f"at most {_MOST_NAMED} bytes that name arrays", "Store the take alone."
        raise InputError("file", expected, f"{size}", fix)


def kind_of(path: Path, _asked: str | None = None) -> Literal["take", "rig"]:
    """Kind of an archive: a rig has a neutral and faces, anything else is a track."""
    with open_archive(path) as archive:
        return "rig" if "neutral" in archive and "faces" in archive else "take"


def read_npz_take(
    path: Path,
    target: str | None = None,
    fps: float | None = None,
    keep: Sequence[str] = (),
    sparse: bool = False,
) -> Take:
    """Read a track; `fps` is for a file that does not state it.

    Weights that are a clock, a counter or a flag are left out, unless they are in `keep`; `sparse`
    tracks are poses of single frames.

    `target` is one of several; one alone, or none, needs no choice, and `NO_TARGET` is none of
    them.

    Raises `InputError` naming the file and the key that is at fault; the targets there are.
    """
    with open_archive(path) as archive:
        source = _read_source(archive)
        time, rate = _clock(archive, len(source.values), fps)
        key = None if target == NO_TARGET else _choose(_targets(archive), target, "--target")
        params = None if key is None else archive.numbers(key)
        controls = None if key is None else Controls(archive.names(_names_key(key, archive)))
        take = Take(time=time, source=source, controls=controls, params=params, fps=rate)
        return learnable(take, keep, sparse)


def targets_of(path: Path) -> dict[str, tuple[str, ...]]:
    """The targets of a track, and the controls of each; none of a rig, or where there is no file.

    Raises `InputError` when the file is no .npz archive, or names in it are damaged.
    """
    if not path.is_file() or kind_of(path) == "rig":
        return {}
    with open_archive(path) as archive:
        return {key: archive.names(_names_key(key, archive)) for key in _targets(archive)}


def read_npz_rig(path: Path, shapes: str | None = None) -> Rig:
    """Read a rig; `shapes` is the KEY of ``KEY_deltas`` where there are several sets of shapes.

    Raises `InputError` naming the file and the key that is at fault; the sets of shapes there are.
    """
    with open_archive(path) as archive:
        sets = [key.removesuffix("_deltas") for key in archive.keys if key.endswith("_deltas")]
        prefix = _choose(sets, shapes, "--shapes")
        before = "" if prefix is None else f"{prefix}_"
        return Rig(
            neutral=archive.numbers("neutral"),
            shapes=archive.numbers(f"{before}deltas"),
            names=archive.names(f"{before}names"),
            faces=archive.integers("faces"),
        )


def _declared(stream: IO[bytes], held: int) -> tuple[np.dtype[Any], int]:
    """Type and size of an array, after a look at whether the archive holds as much."""
    version = npy_format.read_magic(stream)
    read_header = {
        (1, 0): npy_format.read_array_header_1_0,
        (2, 0): npy_format.read_array_header_2_0,
    }.get(version)
    if read_header is None:
        raise ValueError("unknown version")
    shape, _, dtype = read_header(stream)
    count = math.prod(shape)
    if count < 0 or count * max(dtype.itemsize, 1) > held:
        raise ValueError("declares more than there is")
    return dtype, count


def _read_source(archive: Archive) -> Source:
    for key, names in _SOURCES.items():
        if key in archive:
            values = archive.numbers(key)
            layout = ("T", "D") if key == "weights" else ("T", "M", "3")
            require_shape(values.shape, layout, key, "One row a frame.")
            return Source(values, archive.names(names))
    there = ", ".join(archive.keys[:8]) or "nothing"
    raise InputError("keys", " or ".join(_SOURCES), there, "Store the source; see the layout.")


def _targets(archive: Archive) -> list[str]:
    """Keys that come with names of their own and are not the source."""
    keys = (key for key in archive.keys if key not in _SOURCES)
    return [key for key in keys if _names_key(key, archive) in archive]


def _names_key(key: str, archive: Archive) -> str:
    own = f"{key}_names"
    return own if own in archive else f"{key.removesuffix('s')}_names"


def _choose(present: list[str], asked: str | None, option: str) -> str | None:
    """The key that was asked for, or the only one; None when there is none.

    A rig's `unit_deltas` are the shapes of a track's `units`: either word will do for both.
    """
    if asked in present:
        return asked
    alike = [key for key in present if asked and key.rstrip("s") == asked.rstrip("s")]
    if len(alike) == 1:
        return alike[0]
    if asked is None and len(present) < 2:
        return present[0] if present else None
    found = "none" if asked is None else repr(asked)
    there = ", ".join(present) or "nothing"
    raise InputError(option, f"one of: {there}", found, f"Choose with {option}.")


def _clock(archive: Archive, frames: int, fps: float | None) -> tuple[FloatArray, float]:
    """Time of the frames, and the nominal rate."""
    time = in_seconds("time", archive.numbers("time")) if "time" in archive else None
    if "fps" in archive:
        fps = standard_rate(archive.number("fps"))
    elif time is not None:
        fps = nominal_rate(time)
    if not fps:
        fix = "Store fps, or run facert convert with --in-fps."
        raise InputError("fps", "the rate of the frames", "none", fix)
    return np.arange(frames) / fps if time is None else time, fps
