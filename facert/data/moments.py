"""What a frame is called: its number, as options count it, and its timecode or its seconds."""

from __future__ import annotations

from typing import Protocol

from facert.data.arrays import FloatArray
from facert.data.timecode import timecode


class Timed(Protocol):
    """What has frames in time: a take, or a mesh in motion."""

    @property
    def time(self) -> FloatArray:
        """Seconds, (T,)."""

    @property
    def fps(self) -> float:
        """Nominal frames a second."""

    @property
    def start_timecode(self) -> str:
        """Of time 0; empty when unknown."""


def timecode_of(timed: Timed, frame: int) -> str:
    """The timecode of a frame; empty where there is none."""
    return timecode(timed.start_timecode, float(timed.time[frame]), timed.fps)


def moment(timed: Timed, frame: int) -> str:
    """When a frame was: its timecode, or its seconds where there is none."""
    return timecode_of(timed, frame) or f"{timed.time[frame]:.2f} s"


def frame_label(timed: Timed, frame: int) -> str:
    """The number of a frame, from 0, and when it was: for pictures.

    >>> import numpy as np
    >>> from facert.data.take import Source, Take
    >>> frame_label(Take(np.arange(4) / 4, Source(np.ones((4, 1)), ("a",)), fps=4.0), 3)
    '3   0.75 s'
    """
    return f"{frame}   {moment(timed, frame)}"
