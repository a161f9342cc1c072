"""C3D marker files, read by the package c3d.

Its reader is pure Python: bytes that make no sense end in an exception, not in a crash. A point is
not observed where its residual is below 0, or a coordinate is NaN. Labels beyond 255 go on in
``LABELS2`` and so on; points without a label, or with a star in front, were not identified.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.memory import FLOAT, FileMemory
from facert.data.rate import standard_rate
from facert.data.take import Source, Take
from facert.data.text import plural
from facert.errors import InputError, reading
from facert.io.guarded import moderate_file, parsing

if TYPE_CHECKING:
    from c3d import Reader

log = logging.getLogger("facert")

_KEY = 0x50
"""The second byte of every C3D file."""
_POINT = 4 * (5 + 5 + 4) + FLOAT * 3
"""Bytes of a point in a frame: position, residual and cameras, stacked, and what is kept of it."""
_AXES = {f"{sign}{axis.upper()}": axis for sign in ("", "+") for axis in "xyz"}


def read_c3d(path: Path) -> Take:
    """Read a C3D file as a take whose source is markers, (T, M, 3) in the file's units.

    A subject's name that all labels begin with (``Anna:LBROW``) is left out. Time counts from the
    first frame.

    Raises `InputError` naming the file and what is at fault: no C3D file, fewer frames than it
    declares, no labelled point, or a doubled label.
    """
    with reading(path), moderate_file(path).open("rb") as file, _parsing():
        if file.read(2)[1:] != bytes([_KEY]):
            raise InputError("file", "a C3D file", "something else", "Export it again.")
        file.seek(0)
        return _read(file, FileMemory(path))


@contextmanager
def _parsing() -> Iterator[None]:
    """An error about the file for whatever the package raises; its warnings are passed over."""
    quiet = warnings.catch_warnings()
    with parsing("file", "a whole C3D file"), np.errstate(all="ignore"), quiet:
        warnings.simplefilter("ignore")
        yield


def _read(file: BinaryIO, memory: FileMemory) -> Take:
    from c3d import Reader

    reader = Reader(file)
    points = _points(reader, memory)
    labels, kept = _identified(_labels(reader), points.shape[1])
    positions, residual = points[:, kept, :3].astype(np.float64), points[:, kept, 3]
    positions[~(residual >= 0)] = np.nan
    rate = float(reader.point_rate)
    if not 0 < rate < np.inf:
        raise InputError("POINT:RATE", "frames a second", f"{rate}", "Export the file again.")
    rate = standard_rate(rate)
    return Take(
        time=np.arange(len(positions)) / rate,
        source=Source(positions, _without_subject(labels)),
        fps=rate,
        units=_text(reader, "POINT:UNITS").lower(),
        up_axis=_AXES.get(_text(reader, "POINT:Y_SCREEN").upper(), ""),
    )


def _points(reader: Reader, memory: FileMemory) -> FloatArray:
    """Read all points of the file, (T, points, 5): position, residual, cameras."""
    declared = reader.last_frame - reader.first_frame + 1
    if reader.point_used < 1:  # frames without a point have no bytes: any number may be declared
        raise InputError("POINT:USED", "points", "none", "Export the markers as well.")
    analog = reader.analog_used * reader.analog_per_frame
    memory.require(max(0, declared) * _POINT * reader.point_used + FLOAT * analog, "frames")
    frames = [points for _, points, _ in reader.read_frames()]
    if not frames or len(frames) != declared:
        raise InputError("frames", f"{declared} as declared", f"{len(frames)}", "Export it again.")
    return np.stack(frames)


def _labels(reader: Reader) -> list[str]:
    """The labels of the points, in all their parts."""
    labels: list[str] = []
    for part in count(1):
        found = reader.get(f"POINT:LABELS{part if part > 1 else ''}")
        if found is None:
            return labels
        labels += [str(label).strip().strip("\0") for label in np.ravel(found.string_array)]
    raise AssertionError("the parts end")  # pragma: no cover


def _identified(labels: Sequence[str], points: int) -> tuple[list[str], list[int]]:
    """The labels that name a marker, and the points that bear them."""
    kept = [i for i, name in enumerate(labels[:points]) if name and not name.startswith("*")]
    if not kept:
        raise InputError(
            "POINT:LABELS", "labelled markers", f"none of {points}", "Label the capture first."
        )
    if len(kept) < points:
        log.info("left out %s without a label", plural(points - len(kept), "point"))
    return [labels[i] for i in kept], kept


def _without_subject(labels: Sequence[str]) -> tuple[str, ...]:
    subjects = {label.partition(":")[0] if ":" in label else "" for label in labels}
    if len(subjects) > 1 or "" in subjects:
        return tuple(labels)
    return tuple(label.partition(":")[2] or label for label in labels)


def _text(reader: Reader, name: str) -> str:
    parameter = reader.get(name)
    return "" if parameter is None else str(parameter.string_value).strip().strip("\0")
