"""The actor at rest, told from the first seconds of a session."""

from __future__ import annotations

import numpy as np

from facert.data import FloatArray
from facert.live.frames import Frame
from facert.neutral import median_at_rest


class RestWatch:
    """Collects the frames of the first seconds, in which the actor rests.

    Parameters
    ----------
    seconds : float
        From the session's first frame.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._frames: list[FloatArray] = []
        self.is_over = False
        """Whether the time has passed."""

    def see(self, frame: Frame) -> None:
        """Keep a frame while it is time for that."""
        self.is_over = bool(self._frames) and frame.time >= self._seconds
        if not self.is_over:
            self._frames.append(frame.values)

    def rest(self, scale: float) -> FloatArray:
        """The actor at rest, shape of a frame; NaN where nothing was observed.

        Parameters
        ----------
        scale : float
            The largest standard deviation of a dimension in training: who moves like that does not
            rest, which is warned about.
        """
        frames = np.array(self._frames)
        return median_at_rest(frames.reshape(len(frames), -1), scale).reshape(frames.shape[1:])
