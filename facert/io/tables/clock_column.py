"""The column of a table that has its rows' times: found by name or by shape, in whatever unit.

What is guessed is logged: the column, if it is not called ``time`` or ``frame``, and its unit.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.clock import put_together
from facert.data.column_names import (
    Role,
    is_letter,
    name_words,
    names_face,
    role_of_name,
    unit_of_name,
)
from facert.data.columns import rises
from facert.data.rate import nominal_rate, standard_rate, whole_count
from facert.data.timecode import LIVE_LINK_RATE, TICKS, has_thousandths, parse_timecode
from facert.data.timecode_column import read_timecodes
from facert.errors import InputError
from facert.io.tables.clock_text import codes_of_texts, is_time, seconds_of_texts
from facert.io.tables.table import Table

log = logging.getLogger("facert")

# Units by their seconds, and what a clock in them shows when it counts from 1970; ticks count from
# 1601 or from the year 1.
_UNITS = {
    1.0: ("seconds", 9e8, 5e9),
    1e-3: ("milliseconds", 9e11, 5e12),
    1e-6: ("microseconds", 9e14, 5e15),
    1e-9: ("nanoseconds", 9e17, 5e18),
    1e-7: ("ticks of 100 ns", 1.2e17, 7e17),
    60.0: ("minutes", np.inf, np.inf),
}
_OVERRULED = "facert convert --in-fps overrules it"
_SMALL = (1e-3, 1e-6, 1e-9, 1e-7)
_USUAL_RATES, _RATES = (10.0, 250.0), (1.0, 250.0)
_FASTEST = 1000.0
_ENOUGH, _SHAPED = 5, 10  # rows that show a unit, and a clock without a name
_REGULAR = 0.5  # of the usual step, by which most others differ at most
_MOSTLY = 0.8  # of the steps of a clock are forward
_WEIGHTS, _NEAR = 1.5, 0.05  # range of weights, and how near a ramp there comes to a known rate
_LATE = 1e5  # seconds: a clock that begins later counts from elsewhere


@dataclass(frozen=True, eq=False)
class Clock:
    """The times of a table's rows."""

    time: FloatArray
    """Seconds, (T,)."""
    rate: float
    """Nominal frames a second."""
    column: int | None = None
    """The column that has them, if one has."""
    origin: float = 0.0
    """Seconds in the file that are 0 in `time`."""
    start_timecode: str = ""
    """Of the first row, where it is one."""


def clock_of(table: Table, fps: float | None = None, sparse: bool = False) -> Clock:
    """The clock of a table.

    `fps` is the rate of a table that counts frames or has no clock. `sparse` is for rows that are
    single frames of a recording, whose steps show no unit.

    Raises `InputError` naming the column, and the line of a cell that is no time.
    """
    fps = _rate_column(table) if fps is None else fps
    column = _clock_column(table, fps, sparse)
    if column is None:
        return _even(table, fps)
    if column in table.texts:
        return _text_clock(table, column, fps, sparse)
    _require_observed(table, column)
    if _counts_frames(table, column):
        return _frame_clock(table, column, fps)
    return _number_clock(table, column, sparse)


def _clock_column(table: Table, fps: float | None, sparse: bool) -> int | None:
    """The column to take: by name the first that rises, else by shape, else one that is amiss."""
    candidates = _candidates(table)
    for column in candidates:
        if _is_usable(table, column, fps):
            return column
    shaped = None if sparse else _by_shape(table, fps)
    if shaped is not None:
        return shaped
    amiss = (c for c in candidates if fps is None or not _is_idle(table, c))
    return next((c for c in amiss if not is_letter(table.names[c])), None)


def _is_idle(table: Table, column: int) -> bool:
    """Whether a column shows no time at all, so that a rate is enough."""
    values = table.numbers[:, column]
    still = column not in table.texts and bool((values == values[0]).all())
    return still or _counts_frames(table, column)


def _rate_column(table: Table) -> float | None:
    """The rate that a column states in every row."""
    for column, name in enumerate(table.names):
        values = table.numbers[:, column]
        if name_words(name) in (("fps",), ("framerate",), ("frame", "rate")):
            same = bool((values == values[0]).all())
            if same and 0 < values[0] <= _FASTEST:
                log.info(
                    "%r states %g frames a second; facert convert --in-fps overrules it",
                    name,
                    values[0],
                )
                return standard_rate(float(values[0]))
    return None


def _candidates(table: Table) -> list[int]:
    """Columns that are clocks by name, the best first: ``time``, other clocks, frame numbers."""
    ranks = {}
    for column, name in enumerate(table.names):
        role, plain = role_of_name(name), name.strip().lower()
        if role is Role.CLOCK and not names_face(name):
            in_seconds = column not in table.texts and unit_of_name(name) == 1.0
            ranks[column] = 0 if plain == "time" else 1 if in_seconds else 2
        elif role is Role.FRAME:
            ranks[column] = 3 if plain == "frame" else 4
    return sorted(ranks, key=lambda column: ranks[column])


def _counts_frames(table: Table, column: int) -> bool:
    return role_of_name(table.names[column]) is Role.FRAME


def _is_usable(table: Table, column: int, fps: float | None) -> bool:
    """Whether a column rises, mostly, as a clock does; frame numbers need a rate."""
    if column in table.texts:
        texts = table.texts[column]
        codes = bool(codes_of_texts(texts))
        return codes or (all(map(is_time, texts)) and _mostly_rises(seconds_of_texts(texts)))
    if _counts_frames(table, column) and fps is None:
        return False
    values = table.numbers[:, column]
    if is_letter(table.names[column]):
        return rises(values)
    return _mostly_rises(values)


def _mostly_rises(values: FloatArray) -> bool:
    up = np.diff(values) > 0
    return bool(np.isfinite(values).all() and (not len(up) or up.mean() > _MOSTLY))


def _by_shape(table: Table, fps: float | None) -> int | None:
    """The first column without a weight's name that rises steadily, as time does in some unit.

    Where a rate is known, a rise within the range of weights must be at that rate.
    """
    for column, name in enumerate(table.names):
        role = role_of_name(name)
        if names_face(name) or role not in (None, Role.COUNTER) or len(table) < _SHAPED:
            continue
        if column in table.texts:
            clock = _is_usable(table, column, fps)
        else:
            clock = _is_clock(table.numbers[:, column], role is Role.COUNTER, fps)
        if clock:
            log.warning("no column is called time: %r rises as one", name)
            return column
    return None


def _is_clock(values: FloatArray, numbered: bool, fps: float | None) -> bool:
    """Whether values rise steadily at the rate of a recording; `numbered` ones may be of rows."""
    steps = np.diff(values)
    if not (np.isfinite(values).all() and (steps > 0).all() and _is_regular(steps)):
        return False
    if numbered and not ((values - values[0]) % steps.min()).any():
        return False
    rate = 1 / (_unit_by_step(values) * float(np.median(steps)))
    agrees = fps is None or np.ptp(values) > _WEIGHTS or abs(rate - fps) <= _NEAR * fps
    return bool(_RATES[0] < rate <= _FASTEST and agrees)


def _even(table: Table, fps: float | None) -> Clock:
    """Evenly spaced times, of a table without a clock."""
    if fps is None:
        expected = "a column time (seconds) or frame"
        fix = "Add one, or run facert convert with --in-fps, the rate of the rows."
        raise InputError("header", expected, ", ".join(table.names[:4]), fix)
    log.info("no column of times: rows are taken for evenly spaced, %g a second", fps)
    return Clock(np.arange(len(table)) / fps, fps)


def _require_observed(table: Table, column: int) -> None:
    blank = np.flatnonzero(~np.isfinite(table.numbers[:, column]))
    if len(blank):
        name, row = table.names[column], table.place(int(blank[0]))
        fix = "Write the times of all rows, or leave the column out and give --in-fps."
        raise InputError("/time", f"a number in column {name}", f"none in {row}", fix)


def _frame_clock(table: Table, column: int, fps: float | None) -> Clock:
    name, values = table.names[column], table.numbers[:, column]
    if fps is None:
        fix = "Add a column time, or run facert convert with --in-fps; poses of frames of a "
        fix += "recording are brought in by facert convert RECORDING OUT.h5 --poses FILE."
        raise InputError(f"column {name}", "the rate of the frames", "none", fix)
    origin = 0.0 if name.strip().lower() == "frame" else float(values[0])
    seconds = put_together((values - origin) / fps, table.numbers, table.place)
    return Clock(seconds, fps, column, origin / fps)


def _number_clock(table: Table, column: int, sparse: bool) -> Clock:
    name, values = table.names[column], table.numbers[:, column]
    stated = unit_of_name(name)
    unit = _unit_by_size(values) or stated or (1.0 if sparse else _unit_by_step(values))
    plain = name.strip().lower() == "time" and unit == 1.0 and abs(values[0]) < _LATE
    origin = 0.0 if plain else float(values[0])
    seconds = put_together((values - origin) * unit, table.numbers, table.place)
    if not plain:
        start = f", its first, {origin:.15g}, for 0" if origin and not sparse else ""
        log.info(
            "%r is taken for %s%s; facert convert --in-fps overrules it",
            name,
            _UNITS[unit][0],
            start,
        )
    if not sparse:
        _warn_of_rate(name, values, seconds)
    return Clock(seconds, nominal_rate(seconds), column, origin * unit)


def in_seconds(name: str, values: FloatArray) -> FloatArray:
    """Times (T,) in seconds, whatever unit their steps show; the log has another one."""
    plain = values.ndim == 1 and bool(np.isfinite(values).all())
    unit = _unit_by_step(values) if plain else 1.0
    if unit == 1.0:
        return values
    log.info("%r is taken for %s; " + _OVERRULED, name, _UNITS[unit][0])
    return np.asarray((values - values[0]) * unit)


def _unit_by_size(values: FloatArray) -> float | None:
    """The unit of a clock that counts from a year of the calendar."""
    sizes = ((unit, low, high) for unit, (_, low, high) in _UNITS.items())
    return next((unit for unit, low, high in sizes if low <= values[0] < high), None)


def _unit_by_step(values: FloatArray) -> float:
    """The unit in which the usual step gives the rate of a recording; seconds where none does."""
    steps = np.diff(values)
    steps = steps[steps > 0]
    if len(steps) + 1 < _ENOUGH or not _is_regular(steps):
        return 1.0
    step = float(np.median(steps))
    if step <= 1.0:
        return 1.0
    for slowest, fastest in (_USUAL_RATES, _RATES):
        for unit in _SMALL:
            if slowest <= 1 / (unit * step) <= fastest:
                return unit
    return 1.0


def _is_regular(steps: FloatArray) -> bool:
    """Whether most steps are about the usual one."""
    usual = np.median(steps)
    return bool(usual > 0 and np.mean(np.abs(steps - usual) <= _REGULAR * usual) > 0.8)


def _warn_of_rate(name: str, values: FloatArray, seconds: FloatArray) -> None:
    """Warn of a rate that no recording of a face has, and of seconds that may be frames."""
    steps = np.diff(seconds)
    if len(steps) < 2 or not (steps > 0).all():
        return
    rate = 1 / float(np.median(steps))
    if rate < 1 or rate > _FASTEST:
        text = "%r makes %.3g frames a second, which is unlikely: if it is in another unit, "
        log.warning(text + "state the rate with facert convert --in-fps", name, rate)
    elif len(values) >= _ENOUGH and (np.diff(values) == 1.0).all():
        text = "%r rises by 1 a row and is taken for seconds: if it counts frames, state their "
        log.warning(text + "rate with facert convert --in-fps", name)


def _text_clock(table: Table, column: int, fps: float | None, sparse: bool) -> Clock:
    """The clock of a column of text: dates, times of the day, or timecodes."""
    name, texts = table.names[column], table.texts[column]
    for row, text in enumerate(texts):
        if not is_time(text):
            found = repr(text[:40]) if text else "a blank"
            raise table.error(row, column, "a time in numbers, as HH:MM:SS.mmm or a date", found)
    if codes_of_texts(texts):
        code_clock = _counted_clock if sparse else _code_clock
        return code_clock(table, column, fps)
    seconds = seconds_of_texts(texts)
    log.info("%r is taken for times of the clock, from the first row on", name)
    time = put_together(seconds - seconds[0], table.numbers, table.place)
    return Clock(time, nominal_rate(time), column, float(seconds[0]))


def _code_clock(table: Table, column: int, fps: float | None) -> Clock:
    """The clock of timecodes, by what their FF count."""
    log.info("%r is taken for timecodes", table.names[column])
    clock = read_timecodes(codes_of_texts(table.texts[column]), fps)
    assert clock is not None  # they have FF, as was asked before
    time = put_together(clock.seconds, table.numbers, table.place)
    if fps is not None and clock.counts_broken(fps):
        log.info("timecodes of %d a second: counted at %.6g", clock.count, fps)
        return Clock(time * (clock.count / fps), fps, column, start_timecode=clock.start(fps))
    rate = nominal_rate(time)
    return Clock(time, rate, column, clock.first_ticks / TICKS, clock.start(rate))


def _counted_clock(table: Table, column: int, fps: float | None) -> Clock:
    """The clock of timecodes of single frames, which do not show what FF count."""
    name, texts = table.names[column], table.texts[column]
    if fps is None and not any(map(has_thousandths, texts)):
        fix = "Give the recording's rate, facert convert --in-fps, or a column frame."
        raise InputError(f"column {name}", "how many FF make a second", "timecodes alone", fix)
    count = LIVE_LINK_RATE if fps is None or has_thousandths(texts[0]) else whole_count(fps)
    ticks = [parse_timecode(text, count) for text in texts]
    if None in ticks:
        row = ticks.index(None)
        raise table.error(row, column, f"a timecode of {count} frames a second", repr(texts[row]))
    seconds = np.array(ticks, dtype=np.float64) / TICKS
    time = seconds - seconds[0]
    return Clock(time, nominal_rate(time), column, float(seconds[0]))
