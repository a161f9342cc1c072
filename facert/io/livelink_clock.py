"""Timecodes of Live Link Face: ``HH:MM:SS:FF.mmm``, and what a second of theirs counts.

The app counts FF in 1/60 s whatever the rate of the rows, with thousandths; other writers of the
same table count the frames of their own rate, 24 to 50 a second. Which of both a file does shows
where the seconds change.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from facert.data.arrays import IntArray

TICKS = 60_000
"""Ticks a second: timecodes count thousandths of 1/60 s, and are kept as whole numbers."""

APP_COUNT = 60
"""What the app counts a second, whatever the rate of the rows."""

OTHER_COUNTS = (24, 25, 30, 48, 50)

_DAY = 24 * 3600 * TICKS
_TIMECODE = re.compile(r"(\d{1,2}):([0-5]\d):([0-5]\d):([0-5]\d(?:\.\d+)?)")
# So many steps within seconds, and from one second to the next, tell what a second counts.
_ENOUGH_STEPS, _ENOUGH_SECONDS = 10, 2


def parse_timecode(text: str, count: int = APP_COUNT) -> int | None:
    """Ticks since midnight of ``HH:MM:SS:FF.mmm``; None when it is no timecode.

    Parameters
    ----------
    text : str
    count : int
        How many FF make a second.
    """
    found = _TIMECODE.fullmatch(text.strip())
    if found is None or float(found[4]) >= count:
        return None
    hours, minutes, seconds = (int(part) for part in found.groups()[:3])
    return ((hours * 60 + minutes) * 60 + seconds) * TICKS + round(float(found[4]) * TICKS / count)


def format_timecode(ticks: int) -> str:
    """``HH:MM:SS:FF.mmm`` of ticks since a midnight, FF in 1/60 s."""
    seconds, rest = divmod(ticks % _DAY, TICKS)
    hours, minutes = divmod(seconds // 60, 60)
    return f"{hours:02d}:{minutes:02d}:{seconds % 60:02d}:{rest // 1000:02d}.{rest % 1000:03d}"


def counted(ticks: Sequence[int]) -> int:
    """How many FF make a second in a recording: what its rows show, else 60 as the app has it.

    Where FF wraps from one second to the next, its usual step goes on only with the right count.

    Parameters
    ----------
    ticks : sequence of int, length T
        Timecodes of the rows, parsed as the app's.
    """
    seconds, frames = np.divmod(np.asarray(ticks, dtype=np.float64), TICKS)
    frames *= APP_COUNT / TICKS
    steps, passed = np.diff(frames), np.diff(seconds)
    within, across = steps[passed == 0], steps[passed == 1]
    if len(within) < _ENOUGH_STEPS or len(across) < _ENOUGH_SECONDS:
        return APP_COUNT
    shown = np.median(np.median(within) - across)
    fitting = [n for n in OTHER_COUNTS if abs(shown - n) < 0.5 and frames.max() < n]
    return fitting[0] if fitting else APP_COUNT


def unwrap_midnight(ticks: IntArray) -> IntArray:
    """Let time go on past midnight: a step back by more than half a day is a new day."""
    new_days = np.diff(ticks, prepend=ticks[:1]) < -_DAY // 2
    return ticks + _DAY * np.cumsum(new_days)


def says_its_count(text: str) -> bool:
    """Whether a timecode has thousandths, as those that count 1/60 s do."""
    return "." in text
