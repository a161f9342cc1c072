"""Seconds out of the texts that programs write for a row's time.

``HH:MM:SS.mmm``, ``MM:SS.mmm``, ``0 days 00:00:00.033`` (pandas), ISO 8601 dates with a time, and
timecodes ``HH:MM:SS:FF``, whose count of frames a second shows in the rows.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.timecode import Code, parts_of

DAY = 86400.0

_OF_DAY = re.compile(r"(?:(\d+) days? )?(?:(\d{1,3}):)?(\d{1,2}):(\d{1,2}(?:[.,]\d+)?)")
_FF = 2  # digits


def is_time(text: str) -> bool:
    """Whether a text is a time of the day, a date with a time, or a timecode."""
    return bool(codes_of_texts([text])) or not np.isnan(_seconds(text))


def seconds_of_texts(texts: Sequence[str]) -> FloatArray:
    """Seconds of texts that are times or dates, (T,); times of a day go on past midnight."""
    return _past_midnight(np.array([_seconds(text) for text in texts]))


def codes_of_texts(texts: Sequence[str]) -> list[Code]:
    """The parts of timecodes with FF; empty unless all are timecodes."""
    found = [code for code in map(parts_of, texts) if code is not None and _has_frames(code)]
    return found if len(found) == len(texts) else []


def _has_frames(code: Code) -> bool:
    """Whether a timecode has FF, and no decimals of the second."""
    return bool(code.frame) and (code.mark in ":;" or len(code.frame) == _FF)


def _seconds(text: str) -> float:
    """Seconds of a time of day or a date; NaN for neither."""
    found = _OF_DAY.fullmatch(text)
    if found is not None:
        days, hours, minutes = (float(part or 0) for part in found.groups()[:3])
        return DAY * days + 3600 * hours + 60 * minutes + float(found[4].replace(",", "."))
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return float("nan")
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return moment.timestamp()


def _past_midnight(seconds: FloatArray) -> FloatArray:
    """Times of a day that go on past its end."""
    new_days = np.diff(seconds, prepend=seconds[:1]) < -DAY / 2
    return seconds + DAY * np.cumsum(new_days)
