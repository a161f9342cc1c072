"""A column of timecodes: when its rows are, by how many FF make a second.

That is found from all that the rows say: FF below it, and, where the seconds change, steps that go
on as within them. Live Link Face counts sixtieths and their thousandths; other writers of its table
the frames of their own rate, drop-frame, or milliseconds.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.rate import AGREES, BROKEN, whole_count
from facert.data.timecode import (
    LIVE_LINK_RATE,
    TICKS,
    Code,
    can_drop,
    dropped_numbers,
    format_timecode,
    frame_number,
    frames_of_a_day,
    hms,
)

log = logging.getLogger("facert")

COUNTS = (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 100, 120)
"""How many FF may make a second."""

_RARE = (16, 18, 72, 90, 96, 144, 240)  # where the rows leave no other
_LIKELY = (30, 60, 25, 24, 50, 48, 120, 100)  # of rows that count their own frames
_LIKELY_FINER = (60, 30, 25, 24, 50, 48, 120, 100)  # of rows some FF apart
_WHOLE_SECOND = (24, 25, 48, 50, 100)  # rows from FF 0 to the last: a second and no more
_MILLISECONDS = 1000
_GOES_ON = 0.5  # of a usual step, by which the step to the next second differs at most
_EXACT = 0.05
_STEPS, _SECONDS = 10, 2  # within seconds, and to the next
_ROWS = 3  # show that what stands after FF counts them


@dataclass(frozen=True, eq=False)
class TimecodeClock:
    """When the rows of a column of timecodes are."""

    seconds: FloatArray
    """From the first row to each, (T,); not necessarily rising."""
    count: int
    """How many FF make a second."""
    drop: bool
    """Whether it is drop-frame: then `count` FF are 1.001 s."""
    first: str
    """The first timecode, FF in its own count; empty where there is none."""
    first_ticks: int
    """Ticks from midnight to it."""

    @property
    def is_exact(self) -> bool:
        """Whether the times are known without a rate: the app's sixtieths and their thousandths."""
        return "." in self.first and self.count == LIVE_LINK_RATE

    def counts_broken(self, fps: float) -> bool:
        """Whether FF count the frames of a rate as 29.97, none of whose numbers are dropped."""
        parts = "." in self.first
        return fps in BROKEN and self.count == whole_count(fps) and not (self.drop or parts)

    def start(self, fps: float) -> str:
        """The first timecode so that its count shows when it is read alone.

        With thousandths that is 1/60 s, without them frames at the take's own rate.
        """
        own = LIVE_LINK_RATE if "." in self.first else whole_count(fps)
        shows = self.first and own == self.count and not (self.drop and "." in self.first)
        return self.first if shows else format_timecode(self.first_ticks)


@dataclass(frozen=True, eq=False)
class _Column:
    whole: FloatArray  # seconds since midnight, (T,)
    frames: FloatArray  # FF with what stands after it, (T,)
    thousandths: bool  # whether something does
    may_drop: bool  # by the mark before FF
    counts: tuple[int, ...]  # that FF leave possible

    def numbers(self, count: int) -> FloatArray:
        """Frames since midnight, (T,), if so many make a second."""
        return frame_number(self.whole, self.frames, count, self.drops(count))

    def drops(self, count: int) -> bool:
        """Whether it is drop-frame, if so many make a second: no row has a number left out."""
        if not (self.may_drop and can_drop(count)):
            return False
        minutes, seconds = np.divmod(self.whole, 60)
        left_out = (minutes % 10 > 0) & (seconds == 0) & (self.frames < dropped_numbers(count))
        return not left_out.any()

    def skips(self, count: int) -> bool:
        """Whether rows of every frame leave out just the numbers that drop-frame does."""
        if not can_drop(count) or self.thousandths or self.in_parts:
            return False
        minutes = self.whole // 60
        into = np.flatnonzero(np.diff(minutes) == 1) + 1
        taken = np.diff(count * self.whole + self.frames)
        skipped = np.where(minutes[into] % 10 > 0, dropped_numbers(count), 0)
        full = bool((minutes[into] % 10 > 0).any() and np.median(taken) == 1)
        return full and bool((taken[into - 1] == 1 + skipped).all())

    def usual(self, count: int) -> float:
        """The usual step from row to row, in FF: within seconds, where any is."""
        steps = np.diff(self.numbers(count))
        within = steps[self.within & (steps > 0)]
        rising = within if len(within) else steps[steps > 0]
        if not len(rising):
            return 1.0
        return float(np.mean(rising[rising <= 1.6 * np.median(rising)]))

    def gap(self, count: int) -> float:
        """By how much of a usual step that to the next second differs; infinite if none shows.

        Parts of FF are the app's, so that it takes more to show something else.
        """
        least_within, least_across = (_STEPS, _SECONDS) if self.in_parts else (1, 1)
        if self.within.sum() < least_within or self.across.sum() < least_across:
            return np.inf
        usual = self.usual(count)
        across = np.diff(self.numbers(count))[self.across]
        return abs(float(np.median(across)) - usual) / usual

    def allows(self, count: int) -> bool:
        """Whether a stated rate may mean that so many make a second: parts of FF are the app's."""
        return not self.in_parts or count == LIVE_LINK_RATE or LIVE_LINK_RATE not in self.counts

    @property
    def in_parts(self) -> bool:
        """Whether rows lie between FF."""
        return bool(np.mod(self.frames, 1).any())

    @property
    def across(self) -> BoolArray:
        """Which steps go to the next second, (T - 1,)."""
        return np.asarray(np.diff(self.whole) == 1)

    @property
    def within(self) -> BoolArray:
        """Which steps stay in a second, (T - 1,)."""
        return np.asarray(np.diff(self.whole) == 0)


def read_timecodes(codes: Sequence[Code], fps: float | None = None) -> TimecodeClock | None:
    """The clock of some timecodes; None when they have no FF.

    `fps` is the rate of the rows, where it is known: it decides between counts that are possible.
    The log has the count, and which others are possible.
    """
    if not any(code.frame for code in codes):
        return None
    column = _column(codes)
    count = _count(column, fps)
    if not column.may_drop and column.skips(count):
        column = replace(column, may_drop=True)
        log.info("timecodes leave out the first numbers of minutes, as drop-frame does")
    drop = column.drops(count)
    if column.may_drop and can_drop(count) and not drop:
        log.warning("timecodes have numbers that drop-frame leaves out: not taken for drop-frame")
    if count not in (LIVE_LINK_RATE, _MILLISECONDS) or drop:
        log.info("timecodes count %d frames a second%s", count, ", drop-frame" if drop else "")
    units = np.rint(1000 * column.numbers(count)).astype(np.int64)
    day = 1000 * frames_of_a_day(count, drop)
    units += day * np.cumsum(np.diff(units, prepend=units[:1]) < -day // 2)  # past midnight
    stretch = 1.001 if drop else 1.0
    seconds = (units - units[0]) / (1000 * count) * stretch
    ticks = round(int(units[0]) * TICKS * stretch / (1000 * count))
    return TimecodeClock(seconds, count, drop, _first(column, count, drop), ticks)


def _column(codes: Sequence[Code]) -> _Column:
    """The numbers of timecodes, and what may make a second."""
    whole = np.array([code.seconds for code in codes], dtype=np.float64)
    marks = {code.mark for code in codes if code.frame}
    digits = {len(code.frame) for code in codes if code.frame}
    fractions = [code.fraction for code in codes]
    if marks <= set(".,") and not any(fractions) and digits != {2}:
        decimals = [1000 * float(f"0.{code.frame or 0}") for code in codes]
        return _Column(whole, np.array(decimals), False, False, (_MILLISECONDS,))
    frames = np.array([float(code.frame or 0) for code in codes])
    counts = _possible_counts(frames.max(), any(fractions), digits == {3})
    column = _Column(whole, frames, False, marks <= set(";."), counts)
    if not any(fractions):
        return column
    if _is_running(fractions, column):
        log.info("what stands after FF in timecodes is the number of the frame: left out")
        return column
    parts = [float(f"0.{fraction or 0}") for fraction in fractions]
    return replace(column, frames=frames + parts, thousandths=True)


def _possible_counts(highest: float, thousandths: bool, three_digits: bool) -> tuple[int, ...]:
    """What may make a second: more than the highest FF, or just so many, if that was rounded."""
    known = (*COUNTS, _MILLISECONDS) if three_digits else COUNTS
    counts = tuple(n for n in known if highest < n or (thousandths and highest == n))
    return counts or tuple(n for n in _RARE if highest < n) or (_MILLISECONDS,)


def _is_running(fractions: Sequence[str], column: _Column) -> bool:
    """Whether what stands after FF counts the rows, or the frames, instead of parts of FF.

    A clock of 59.94 or 29.97 frames a second in sixtieths has such parts as well, up to where they
    come to a whole FF.
    """
    if len(fractions) < _ROWS or not all(fractions):
        return False
    turn = 10 ** max(map(len, fractions))
    numbers = np.array([float(fraction) for fraction in fractions])
    steps, taken = np.diff(numbers) % turn, np.diff(column.frames)
    turned = (np.diff(numbers) < 0)[column.within]
    steps, taken = steps[column.within], taken[column.within]
    if len(taken) >= _ROWS and (steps == taken).all():
        gap, count = min((column.gap(count), count) for count in column.counts)
        running = bool(turned.any()) or (gap <= _EXACT and count != LIVE_LINK_RATE)
        if not running and taken.all():
            rate = LIVE_LINK_RATE / float(np.median(taken))
            text = "FF with its parts makes %.4g frames/s; --in-fps %.4g if the parts count frames"
            log.info(text, rate / 1.001, rate)
        return running
    whole = turned.any() and taken[turned].min() > np.median(taken)  # parts that came to a whole FF
    moves = np.ptp(column.frames) > 0 or np.ptp(column.whole) > 0
    counts_rows = bool(moves and (np.diff(numbers) % turn == 1).all())
    return counts_rows and numbers[0] in (0, 1) and not whole


def _count(column: _Column, fps: float | None) -> int:
    """How many FF make a second, by the steps to the next; the log has what else is possible."""
    counts = column.counts
    if len(counts) == 1:
        return counts[0]
    if np.ptp(column.frames) == 0 and LIVE_LINK_RATE in counts:
        return LIVE_LINK_RATE  # any count gives the same steps
    gaps = {count: column.gap(count) for count in (*counts, *_RARE)}
    best = min(counts, key=lambda count: gaps[count])
    if gaps[best] > _EXACT:
        rare = [n for n in _RARE if gaps[n] <= _EXACT and column.frames.max() < n]
        best = rare[0] if rare else best
    if gaps[best] <= _EXACT:
        return best
    possible = [count for count in counts if gaps[count] <= _GOES_ON] or list(counts)
    if column.usual(possible[0]) <= 1:
        possible = [n for n in possible if column.drops(n)] or possible
    agreeing = [n for n in possible if fps and _agrees(n, column, fps) and column.allows(n)]
    if agreeing:
        return best if best in agreeing else agreeing[0]
    if column.thousandths and LIVE_LINK_RATE in possible:
        return LIVE_LINK_RATE
    taken = best if np.isfinite(gaps[best]) else _likely(column, possible)
    if len(possible) > 1:
        listed = ", ".join(map(str, possible[:-1])) + f" or {possible[-1]}"
        log.warning(
            "timecodes may count %s a second: taken as %d (facert convert --in-fps decides)",
            listed,
            taken,
        )
    return taken


def _agrees(count: int, column: _Column, fps: float) -> bool:
    """Whether rows come at that rate, if so many FF make a second."""
    return abs(count / column.usual(count) - fps) <= AGREES * fps


def _likely(column: _Column, possible: Sequence[int]) -> int:
    """The likeliest count of rows in one second: with FF from 1 on their own frames."""
    usual, highest = column.usual(possible[0]), int(column.frames.max())
    if usual == 1 and column.frames[0] == 0 and highest + 1 in _WHOLE_SECOND:
        return highest + 1
    order = _LIKELY if usual <= 1 else _LIKELY_FINER
    natural = [n for n in order if n in possible and any(_agrees(n, column, r) for r in COUNTS)]
    return next(iter([*natural, *(n for n in order if n in possible), *possible]))


def _first(column: _Column, count: int, drop: bool) -> str:
    """The first timecode; empty where FF is none, or rounded to the next second."""
    frame, thousandths = divmod(round(1000 * column.frames[0]), 1000)
    if count == _MILLISECONDS or frame >= count:
        return ""
    moment = f"{hms(int(column.whole[0]))}{';' if drop else ':'}{frame:02d}"
    return f"{moment}.{thousandths:03d}" if column.thousandths else moment
