"""Timecodes of frames: as editors count them, and as Live Link Face does.

``HH:MM:SS:FF`` counts frames of the take's own rate; Live Link Face counts FF in 1/60 s, whatever
the rate, with thousandths: ``HH:MM:SS:FF.mmm``.
"""

from __future__ import annotations

import re

LIVE_LINK_RATE = 60
"""Live Link Face counts sixtieths of a second and their thousandths, whatever the rate."""

TICKS = 1000 * LIVE_LINK_RATE
"""Ticks a second: thousandths of 1/60 s, kept as whole numbers."""

DAY = 24 * 3600 * TICKS

_TIMECODE = re.compile(r"(\d{1,2}):([0-5]\d):([0-5]\d):(\d{1,3}(?:\.\d+)?)")


def _parts(text: str) -> tuple[int, float] | None:
    """Whole seconds since midnight, and FF; None when it is no timecode."""
    found = _TIMECODE.fullmatch(text.strip())
    if found is None:
        return None
    hours, minutes, seconds = map(int, found.groups()[:3])
    return (hours * 60 + minutes) * 60 + seconds, float(found[4])


def has_thousandths(text: str) -> bool:
    """Whether a timecode has thousandths, and so counts 1/60 s."""
    return "." in text


def timecode(start: str, seconds: float, fps: float) -> str:
    """Timecode of a frame, `seconds` after the first one; empty where that of the first is none.

    `start` is ``HH:MM:SS:FF`` of the first frame, FF counted in `fps`, or Live Link Face's
    ``HH:MM:SS:FF.mmm``. A broken rate as 29.97 counts as many frames as the next whole one.

    >>> timecode("01:00:00:20", 0.5, 24), timecode("10:30:05:59.500", 1 / 60, 30)
    ('01:00:01:08', '10:30:06:00.500')
    """
    parts = _parts(start)
    if parts is None:
        return ""
    rate = LIVE_LINK_RATE if has_thousandths(start) else fps
    base = max(1, round(rate))
    frame = parts[0] * base + parts[1] + seconds * rate
    if has_thousandths(start):
        return format_timecode(round(1000 * frame))
    return _written(round(frame), base)


def recounted(start: str, old: float, new: float) -> str:
    """``HH:MM:SS:FF`` with FF at another rate; any other timecode as it is."""
    parts = _parts(start)
    if parts is None or has_thousandths(start):
        return start
    frame = int(int(parts[1]) / max(round(old), 1) * round(new) + 1e-6)
    return f"{start.strip().rpartition(':')[0]}:{frame:02d}"


def parse_timecode(text: str, count: int = LIVE_LINK_RATE) -> int | None:
    """Ticks since midnight of ``HH:MM:SS:FF.mmm``; None when it is no timecode.

    `count` is how many FF make a second.
    """
    parts = _parts(text)
    if parts is None or parts[1] >= count:
        return None
    return parts[0] * TICKS + round(parts[1] * TICKS / count)


def format_timecode(ticks: int) -> str:
    """``HH:MM:SS:FF.mmm`` of ticks since a midnight, FF in 1/60 s."""
    count, rest = divmod(ticks, 1000)
    return f"{_written(count, LIVE_LINK_RATE)}.{rest:03d}"


def _written(count: int, base: int) -> str:
    seconds, frame = divmod(count % (24 * 3600 * base), base)
    minutes = seconds // 60
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{seconds % 60:02d}:{frame:02d}"
