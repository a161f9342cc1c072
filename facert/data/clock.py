"""The clock of a recording, made to rise: set back while the recording went on, or rows astray.

A clock that daylight saving or network time sets back goes on by its usual steps from there. A row
that comes late, or twice, does not: after it the clock is where it was. What distinguishes them is
whether the clock goes on from the row that steps back, or jumps to where it would be without it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.text import plural

log = logging.getLogger("facert")

ORDINARY = 1.5
"""A step of so many usual ones is an ordinary step, at most."""

HOUR = 3600.0

_DROP_HOUR = 107892 * 1001 / 30000  # seconds of an hour of drop-frame timecodes
_MISSING = 60.0  # seconds without rows, where a clock was set back by whole hours
_AROUND = 15  # rows on either side that show how the clock goes there
_ENOUGH = 3  # rows that go on after a step back
_FEW, _RARE = 5, 0.02  # steps back, and their share of the rows: more are no clock that was set
_COMPARED = 100  # rows
_SAME = 1e-6  # seconds
_LOGGED = 5


def _row(index: int) -> str:
    return f"row {index + 1}"


def rising(
    seconds: FloatArray, values: FloatArray, place: Callable[[int], str] = _row
) -> tuple[IntArray, FloatArray]:
    """Rows of a recording to keep, (n,), and their seconds, which rise.

    A clock (T,) that was set back is `put_together`; rows that then come after a later one, or
    twice, are dropped, which the log has. Seconds that are not finite are kept as they are.
    """
    together = put_together(seconds, values, place)
    rows = np.arange(len(seconds))
    if not np.isfinite(seconds).all():
        return rows, seconds
    latest_before = np.maximum.accumulate(together)[:-1]
    kept = np.flatnonzero(np.append(True, together[1:] > latest_before))
    if len(kept) < len(rows):
        log.warning("dropped %s whose time does not rise", plural(len(rows) - len(kept), "row"))
    return kept, together[kept]


def put_together(
    seconds: FloatArray, values: FloatArray, place: Callable[[int], str] = _row
) -> FloatArray:
    """The seconds of all rows (T,): a clock that was set back goes on by its usual step.

    `values` (T, ...) show which rows are there twice. Rows that are late or twice stay where they
    are, and seconds that are not finite, or rise, as they are. The log has where the clock was set
    back, by each row's `place` in its file, and how far.
    """
    steps = np.diff(seconds)
    backs = np.flatnonzero(steps < 0) + 1
    few = 0 < len(backs) <= _FEW + _RARE * len(seconds)
    if not (few and np.isfinite(seconds).all() and (steps > 0).any()):
        return seconds
    values = values.reshape(len(values), -1)
    usual = float(np.median(steps[steps > 0]))
    together, sizes = seconds.copy(), []
    ends = np.append(backs[1:], len(seconds))
    for row, end in zip(backs.tolist(), ends.tolist(), strict=True):
        if not _was_set(together, values, row, end, usual):
            continue
        size = _size(float(together[:row].max()) + usual - together[row])
        together[row:] += size
        sizes.append((size, place(row)))
    for size, where in sizes[:_LOGGED]:
        log.warning("the clock steps back by %.4g s at %s: put together", size, where)
    if len(sizes) > _LOGGED:
        log.warning("the clock steps back %d times more: put together", len(sizes) - _LOGGED)
    return together


def _size(size: float) -> float:
    """How far a clock was set back: whole hours where rows missing there account for the rest."""
    hours = np.ceil(size / HOUR)
    if abs(size - _DROP_HOUR * hours) < _SAME * hours:
        return size
    return HOUR * hours if HOUR * hours - size < _MISSING else size


def _was_set(seconds: FloatArray, values: FloatArray, row: int, end: int, usual: float) -> bool:
    """Whether the clock goes on from a row that steps back, up to the next one that does."""
    before, after = seconds[:row], seconds[row:end]
    if len(after) < _ENOUGH or _lag(before, seconds[row:], usual) < 0.5 * usual:
        return False
    behind = int(np.searchsorted(after, before.max(), side="right"))
    steps = np.diff(after[: behind + 1])
    if behind < len(after):
        goes_on = bool(steps[-1] <= ORDINARY * usual)
    else:
        goes_on = bool(np.median(steps) <= ORDINARY * usual) and not _in_holes(before, after, usual)
    return goes_on and not _are_copies(seconds, values, row, row + behind)


def _lag(before: FloatArray, after: FloatArray, usual: float) -> float:
    """Seconds by which rows come earlier than those before them, going on, would have it."""
    before, after = before[-_AROUND:], after[:_AROUND]
    expected = np.median(before + usual * np.arange(len(before), 0, -1))
    return float(expected - np.median(after - usual * np.arange(len(after))))


def _in_holes(before: FloatArray, late: FloatArray, usual: float) -> bool:
    """Whether most of these seconds lie where rows are missing among those before."""
    there = np.sort(before)
    after = np.clip(np.searchsorted(there, late), 1, len(there) - 1)
    inside = (late > there[0]) & (late < there[-1])
    wide = there[after] - there[after - 1] > ORDINARY * usual
    return bool(np.mean(inside & wide) > 0.5)


def _are_copies(seconds: FloatArray, values: FloatArray, first: int, end: int) -> bool:
    """Whether most of these rows were there before, with the same values at the same time."""
    order = np.argsort(seconds[:first], kind="stable")
    rows = np.arange(first, min(end, first + _COMPARED))
    place = np.searchsorted(seconds[:first][order], seconds[rows] - _SAME)
    earlier = order[np.minimum(place, first - 1)]
    same_time = np.abs(seconds[earlier] - seconds[rows]) <= _SAME
    same = same_time & np.array(
        [
            np.array_equal(values[a], values[b], equal_nan=True)
            for a, b in zip(earlier, rows, strict=True)
        ]
    )
    return bool(same.mean() > 0.5)
