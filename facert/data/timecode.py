"""Timecodes of frames, as editors count them."""

from __future__ import annotations

import re

LIVE_LINK_RATE = 60
"""Live Link Face counts sixtieths of a second and their thousandths, whatever the rate."""

_TIMECODE = re.compile(r"(\d{1,2}):([0-5]\d):([0-5]\d):(\d{1,3})(\.\d+)?")


def timecode(start: str, seconds: float, fps: float) -> str:
    """Timecode of a frame; empty where that of the first is none.

    Parameters
    ----------
    start : str
        ``HH:MM:SS:FF`` of the first frame, FF counted in `fps`; or Live Link Face's
        ``HH:MM:SS:FF.mmm``.
    seconds : float
        From the first frame on.
    fps : float
        Frames a second; a broken rate as 29.97 counts as many frames as the next whole one.

    >>> timecode("01:00:00:20", 0.5, 24), timecode("10:30:05:59.500", 1 / 60, 30)
    ('01:00:01:08', '10:30:06:00.500')
    """
    found = _TIMECODE.fullmatch(start.strip())
    if found is None:
        return ""
    fraction = found[5]
    rate = fps if fraction is None else LIVE_LINK_RATE
    base = max(1, round(rate))
    hours, minutes, whole, frames = map(int, found.groups()[:4])
    begun = ((hours * 60 + minutes) * 60 + whole) * base + frames + float(fraction or 0)
    frame = begun + seconds * rate
    return _written(round(frame), base) if fraction is None else _in_thousandths(frame, base)


def _in_thousandths(frame: float, base: int) -> str:
    count, rest = divmod(round(1000 * frame), 1000)
    return f"{_written(count, base)}.{rest:03d}"


def _written(count: int, base: int) -> str:
    seconds, frame = divmod(count % (24 * 3600 * base), base)
    minutes = seconds // 60
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{seconds % 60:02d}:{frame:02d}"
