"""Poses in a file of any kind: a take's poses, or a table that names the frames."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np

from facert.data.labelling import Poses, poses_of, predicted_poses
from facert.data.take import Take
from facert.data.text import plural
from facert.errors import InputError, reading
from facert.io.formats import read_take_file
from facert.io.lines import check_width, read_csv, read_header, to_numbers

log = logging.getLogger("facert")

MAX_FRAMES = 2**31

_FRAME = "frame"


def read_poses(path: Path, fps: float | None = None) -> Poses:
    """Read poses: of a CSV with a column ``frame``, its rows; else of a take, by their times.

    Raises `InputError` when the file cannot be read, a row names no frame, there are no poses in
    it, or a model predicted them all.
    """
    path = Path(path)
    with reading(path):
        if path.suffix.lower() == ".csv" and _names_frames(read_header(path)):
            return replace(_read_numbered(path), where=str(path))
        take = read_take_file(path, fps=fps)
        _require_set(take, path)
        return replace(poses_of(take), where=str(path))


def _require_set(take: Take, path: Path) -> None:
    """Refuse a result of retargeting: what a model predicted would pass for somebody's poses."""
    predicted = predicted_poses(take)
    if predicted and predicted == len(take.labels):
        found = f"a standard deviation for all {predicted}: a model predicted them"
        fix = (
            "Give the poses that were set; to take these nonetheless, make a table of them first: "
        )
        table = f"facert convert {path.name} {path.stem}.csv."
        raise InputError("/target/std", "poses that somebody set", found, fix + table)
    if predicted:
        poses = plural(predicted, "pose")
        log.warning("%s: %s with a standard deviation: predicted, taken as set", path.name, poses)


def _names_frames(header: tuple[str, ...]) -> bool:
    lower = [name.lower() for name in header]
    return _FRAME in lower and "time" not in lower


def _read_numbered(path: Path) -> Poses:
    header, rows = read_csv(path)
    check_width(rows, header)
    place = [name.lower() for name in header].index(_FRAME)
    columns = [column for column in range(len(header)) if column != place]
    numbers = to_numbers(rows, header, [place])[:, 0]
    odd = np.flatnonzero(~((numbers == np.rint(numbers)) & (np.abs(numbers) < MAX_FRAMES)))
    if len(odd):
        row = rows[odd[0]]
        raise row.error(header[place], "a frame's number, whole and from 0", repr(row.cells[place]))
    return Poses(
        names=tuple(header[column] for column in columns),
        values=to_numbers(rows, header, columns),
        frames=numbers.astype(np.int64),
    )
