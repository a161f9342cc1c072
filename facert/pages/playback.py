"""Where a performance stands: its frame, and the clock that moves it on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray


@dataclass
class Playback:
    """The frame that is shown.

    Parameters
    ----------
    time : array, shape (T,)
        Seconds, rising.
    frame : int
    playing : bool
    speed : float
        Seconds of the performance a second.
    """

    time: FloatArray
    frame: int = 0
    playing: bool = False
    speed: float = 1.0

    def __post_init__(self) -> None:
        self._moment = float(self.time[self.frame])

    def seek(self, frame: int) -> None:
        """Go to a frame; the nearest one that there is."""
        self.frame = min(max(frame, 0), len(self.time) - 1)
        self._moment = float(self.time[self.frame])

    def advance(self, seconds: float) -> bool:
        """Let time pass; after the last frame comes the first. Whether the frame changed."""
        if not self.playing:
            return False
        before, self._moment = self.frame, self._moment + self.speed * seconds
        if self._moment > self.time[-1]:
            self._moment = float(self.time[0])
        # The last frame that has begun.
        self.frame = max(int(np.searchsorted(self.time, self._moment, side="right")) - 1, 0)
        return self.frame != before
