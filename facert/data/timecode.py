"""Timecodes of frames: as editors count them, with drop-frame, and as Live Link Face does.

``HH:MM:SS:FF`` counts frames of the take's own rate; Live Link Face counts FF in 1/60 s, whatever
the rate, with thousandths: ``HH:MM:SS:FF.mmm``. ``HH:MM:SS;FF`` is drop-frame, which keeps 29.97
and 59.94 frames a second near the clock on the wall: the first two, or four, numbers of a minute
are left out, except in every tenth.
"""

from __future__ import annotations

import re
from typing import NamedTuple, TypeVar

from facert.data.arrays import FloatArray
from facert.data.rate import BROKEN, whole_count

LIVE_LINK_RATE = 60
"""Live Link Face counts sixtieths of a second and their thousandths, whatever the rate."""

TICKS = 1000 * LIVE_LINK_RATE
"""Ticks a second: thousandths of 1/60 s, kept as whole numbers."""

_TIMECODE = re.compile(
    r"(\d{1,2})[:;]([0-5]\d)[:;]([0-5]\d)(?:([:;.,])(\d{1,9})(?:[.,](\d{1,9}))?)?"
)
_DROP_MARKS = ";."
_MOST_DIGITS = 3  # of FF

_Number = TypeVar("_Number", int, float, FloatArray)


class Code(NamedTuple):
    """The parts of a timecode as they are written."""

    seconds: int
    """Whole ones since midnight."""
    mark: str
    """What stands before FF; empty where there is none."""
    frame: str
    fraction: str


def parts_of(text: str) -> Code | None:
    """The parts of a timecode, with or without FF; None when it is none."""
    found = _TIMECODE.fullmatch(text.strip())
    if found is None:
        return None
    hours, minutes, seconds = map(int, found.groups()[:3])
    mark, frame, fraction = (found[group] or "" for group in (4, 5, 6))
    return Code((hours * 60 + minutes) * 60 + seconds, mark, frame, fraction)


def _parts(text: str) -> tuple[int, float, bool] | None:
    """Whole seconds since midnight, FF, and whether it is drop-frame; None for another text."""
    code = parts_of(text)
    if code is None or not 0 < len(code.frame) <= _MOST_DIGITS:
        return None
    if code.mark in ".," and (len(code.frame) != 2 or code.fraction):
        return None
    return code.seconds, float(f"{code.frame}.{code.fraction or 0}"), code.mark in _DROP_MARKS


def has_thousandths(text: str) -> bool:
    """Whether a timecode has a part after FF, and so counts 1/60 s."""
    code = parts_of(text)
    return code is not None and code.fraction != ""


def can_drop(count: int) -> bool:
    """Whether drop-frame is for so many frames a second: 30 and its multiples."""
    return count % 30 == 0


def dropped_numbers(count: int) -> int:
    """How many numbers drop-frame leaves out of most minutes: 2 of 30 a second, 4 of 60."""
    return count // 15


def is_marked_drop(text: str) -> bool:
    """Whether a timecode is written as drop-frame is."""
    parts = _parts(text)
    return parts is not None and parts[2]


def is_drop_frame(text: str, fps: float) -> bool:
    """Whether a timecode is drop-frame, at a rate that has it."""
    return is_marked_drop(text) and can_drop(whole_count(fps)) and fps in BROKEN


def is_dropped(text: str, fps: float) -> bool:
    """Whether a timecode bears a number that drop-frame leaves out."""
    parts = _parts(text)
    if parts is None or not parts[2] or not can_drop(whole_count(fps)):
        return False
    minute, second = divmod(parts[0], 60)
    return bool(minute % 10 and not second and parts[1] < dropped_numbers(whole_count(fps)))


def frame_number(seconds: _Number, frames: _Number, count: int, drop: bool) -> _Number:
    """Frames since midnight, `count` a second; `seconds` are whole."""
    number = seconds * count + frames
    if not drop:
        return number
    minutes = seconds // 60
    return number - dropped_numbers(count) * (minutes - minutes // 10)


def timecode(start: str, seconds: float, fps: float) -> str:
    """Timecode of a frame, `seconds` after the first one; empty where that of the first is none.

    `start` is ``HH:MM:SS:FF`` or drop-frame ``HH:MM:SS;FF`` of the first frame, FF counted in
    `fps`, or Live Link Face's ``HH:MM:SS:FF.mmm``. A broken rate as 29.97 counts as many frames as
    the next whole one.

    >>> timecode("01:00:00:20", 0.5, 24), timecode("10:30:05:59.500", 1 / 60, 30)
    ('01:00:01:08', '10:30:06:00.500')
    >>> timecode("00:00:59;28", 2 / 29.97, 29.97)
    '00:01:00;02'
    """
    parts = _parts(start)
    if parts is None:
        return ""
    if has_thousandths(start) and not parts[2]:
        return format_timecode(round(parts[0] * TICKS + 1000 * parts[1] + seconds * TICKS))
    count = whole_count(fps)
    drop = parts[2] and can_drop(count)
    first = frame_number(float(parts[0]), parts[1], count, drop)
    return _written(round(first + seconds * fps), count, drop)


def recounted(start: str, old: float, new: float) -> str:
    """``HH:MM:SS:FF`` with FF at another rate; any other timecode as it is.

    Drop-frame stays so at a rate that has it.
    """
    parts, counts = _parts(start), (whole_count(old), whole_count(new))
    if parts is None or (has_thousandths(start) and not parts[2]):
        return start
    drop = parts[2] and can_drop(counts[1]) and new in BROKEN
    if counts[0] == counts[1] and drop == parts[2]:
        return start
    frame = int(int(parts[1]) / counts[0] * counts[1] + 1e-6)
    return f"{hms(parts[0])}{';' if drop else ':'}{frame:02d}"


def parse_timecode(text: str, count: int = LIVE_LINK_RATE) -> int | None:
    """Ticks since midnight of ``HH:MM:SS:FF.mmm``; None when it is no timecode.

    `count` is how many FF make a second; of drop-frame 1.001 seconds.
    """
    parts = _parts(text)
    if parts is None or parts[1] >= count:
        return None
    if parts[2] and can_drop(count):
        number = frame_number(float(parts[0]), parts[1], count, drop=True)
        return round(number * 1.001 * TICKS / count)
    return parts[0] * TICKS + round(parts[1] * TICKS / count)


def format_timecode(ticks: int) -> str:
    """``HH:MM:SS:FF.mmm`` of ticks since a midnight, FF in 1/60 s."""
    count, rest = divmod(ticks, 1000)
    return f"{_written(count, LIVE_LINK_RATE, drop=False)}.{rest:03d}"


def frames_of_a_day(count: int, drop: bool) -> int:
    """How many frames a day has, by its timecodes."""
    day = 24 * 3600
    return frame_number(day, 0, count, drop)


def _written(number: int, count: int, drop: bool) -> str:
    number %= frames_of_a_day(count, drop)
    if drop:
        number += dropped_numbers(count) * _minutes_with_dropped(number, count)
    seconds, frame = divmod(number, count)
    return f"{hms(seconds)}{';' if drop else ':'}{frame:02d}"


def _minutes_with_dropped(number: int, count: int) -> int:
    """How many minutes that leave numbers out began before a frame."""
    short = 60 * count - dropped_numbers(count)
    tens, rest = divmod(number, 60 * count + 9 * short)
    return 9 * tens + (0 if rest < 60 * count else 1 + (rest - 60 * count) // short)


def hms(seconds: int) -> str:
    """``HH:MM:SS`` of whole seconds."""
    minutes = seconds // 60
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{seconds % 60:02d}"
