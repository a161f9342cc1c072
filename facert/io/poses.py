"""Poses in a file of any kind: a take's poses, or a table that names the frames."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.column_names import Role, role_of_name
from facert.data.columns import require_there
from facert.data.labelling import Poses, poses_of, predicted_poses, without_predicted
from facert.data.rate import frames_shown, standard_rate
from facert.data.resampling import counted_at
from facert.data.rig import Rig
from facert.data.take import Take
from facert.data.text import for_shell, plural
from facert.errors import InputError
from facert.io.formats import read_any, require_take
from facert.io.guarded import door
from facert.io.lines import read_csv, read_header
from facert.io.tables.clock_column import clock_of
from facert.io.tables.csv_table import is_marked
from facert.io.tables.livelink import is_livelink
from facert.io.tables.table import Table, table_of_lines
from facert.io.tables.table_take import controls_of, unlogged
from facert.io.tables.tracker_json import read_json_table

log = logging.getLogger("facert")

MAX_FRAMES = 2**31

_TABLES = (".csv", ".tsv", ".tab")
_FRAME = "frame"
_FRAMES = 5.0  # rows a second of a table, which are frames and not poses now and then


def read_poses(
    path: Path, fps: float | None = None, keep: Sequence[str] = (), target: str | None = None
) -> Poses:
    """Read poses: of a table or JSON with a column ``frame``, its rows; else of a take, by time.

    `fps` is the rate of the recording, whatever the file states. Columns of a table that are no
    controls, such as a confidence, are left out, and the log names them; those in `keep` stay.
    `target` chooses among several of an .npz track, or animations of a glTF file.

    Raises `InputError` when the file cannot be read, a row names no frame, there are no poses in
    it, or a model predicted them all.
    """
    path = Path(path)
    with door(path):
        table = _numbered_table(path)
        if table is not None:
            poses = _of_numbers(table, keep, fps)
        else:
            take = read_any(path, target, kind="take", or_fps=fps, keep=keep, sparse=True)
            take = _at_rate(take, path, fps)
            poses = poses_of(_set_by_somebody(take, path))
            if take.clock_start and _has_column_of_times(path):
                poses = replace(poses, time=take.time + take.clock_start, of_clock=True)
        return replace(poses, where=str(path))


def numbers_frames(path: Path) -> bool:
    """Whether a file is a table with a column of frame numbers."""
    with door(path):
        return _numbered_table(path) is not None


def _has_column_of_times(path: Path) -> bool:
    """Whether the first pose's time in a file is not where a recording begins."""
    ending = path.suffix.lower()
    return ending == ".json" or (ending in _TABLES and not is_livelink(read_header(path)))


def _numbered_table(path: Path) -> Table | None:
    """The table in a file, if it numbers the frames."""
    ending = path.suffix.lower()
    if ending == ".json":
        table = read_json_table(path)
        return None if table is None or _frame_column(table.names) is None else table
    if ending not in _TABLES or is_livelink(header := read_header(path)) or is_marked(path):
        return None
    return None if _frame_column(header) is None else table_of_lines(*read_csv(path))


def _at_rate(found: Take | Rig, path: Path, fps: float | None) -> Take:
    """The take at the rate of the recording that its poses are for.

    Poses now and then, by their seconds, are no frames to be counted: their times stay.
    """
    take = require_take(found, path)
    if fps is None or abs(take.fps - standard_rate(fps)) <= 1e-6 * fps:
        return take
    few = take.fps < _FRAMES and _has_column_of_times(path)
    if few or frames_shown(take.time) is None:
        log.info(
            "%s: the times of its poses stay: facert convert --in-fps counts frames", path.name
        )
        return take
    return counted_at(take, fps)


def _set_by_somebody(take: Take, path: Path) -> Take:
    """The take without poses that a model predicted: they would pass for somebody's.

    A result of retargeting that holds no others is refused.
    """
    predicted = predicted_poses(take)
    if predicted and predicted == len(take.labels):
        found = f"a model predicted all {predicted} of them"
        fix = (
            "Give the poses that were set; to take these nonetheless, make a table of them first: "
        )
        made = for_shell(f"{path.stem}.csv")
        table = f"facert convert {for_shell(path.name)} {made}."
        raise InputError("/target/std", "poses that somebody set", found, fix + table)
    if predicted:
        poses = plural(predicted, "predicted pose")
        log.info("%s: %s left out, those that somebody set are taken", path.name, poses)
    return without_predicted(take)


def _frame_column(header: Sequence[str]) -> int | None:
    """The column that numbers the frames, unless there is one of seconds."""
    lower = [name.lower() for name in header]
    if "time" in lower:
        return None
    numbering = (i for i, name in enumerate(header) if role_of_name(name) is Role.FRAME)
    return lower.index(_FRAME) if _FRAME in lower else next(numbering, None)


def _of_numbers(table: Table, keep: Sequence[str], fps: float | None) -> Poses:
    """Poses of a table that numbers their frames."""
    require_there(keep, table.names)
    place = _frame_column(table.names)
    assert place is not None  # as was asked before
    numbers = table.numbers[:, place]
    odd = np.flatnonzero(~((numbers == np.rint(numbers)) & (np.abs(numbers) < MAX_FRAMES)))
    if len(odd):
        expected, found = "a frame's number, whole and from 0", f"{numbers[odd[0]]:.10g}"
        found = "a text" if place in table.texts else "a blank" if found == "nan" else found
        raise table.error(int(odd[0]), place, expected, found)
    if table.names[place].strip().lower() != _FRAME:
        log.info("%r is taken for the number of the frame in the take, from 0", table.names[place])
    names, values = controls_of(table, place, keep)
    poses = Poses(names=names, values=values, frames=numbers.astype(np.int64))
    time = _times_beside(table, place, fps)
    return replace(poses, time=time, of_clock=time is not None)


def _times_beside(table: Table, place: int, fps: float | None) -> FloatArray | None:
    """The times of poses (n,) by another column than that of their frames; None without one."""
    others = np.array([column for column in range(len(table.names)) if column != place])
    texts = {c: table.texts[old] for c, old in enumerate(others.tolist()) if old in table.texts}
    names = tuple(table.names[column] for column in others)
    try:
        with unlogged():
            clock = clock_of(Table(names, table.numbers[:, others], texts, table.place), fps, True)
    except InputError:
        return None
    counted = clock.column is None or role_of_name(names[clock.column]) is not Role.CLOCK
    return None if counted else clock.time + clock.origin
