"""The actor at rest, told from the first seconds of a session."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray
from facert.live.frames import Frame
from facert.preprocess.live_faults import MarkerWatch
from facert.preprocess.neutral import median_at_rest

HUGE = 1e100  # whatever the unit, no place: what others do with it would overflow


class RestWatch:
    """Collects the frames of the first seconds, in which the actor rests.

    Parameters
    ----------
    seconds : float
        From the session's first frame.
    watch : MarkerWatch, optional
        Tells which markers are not to be believed: a lost one may be written as (0, 0, 0).
    """

    def __init__(self, seconds: float, watch: MarkerWatch | None = None) -> None:
        self._seconds, self._watch = seconds, watch
        self._frames: list[FloatArray] = []
        self.is_over = False
        """Whether the time has passed."""

    def see(self, frame: Frame) -> None:
        """Keep a frame while it is time for that."""
        self.is_over = bool(self._frames) and frame.time >= self._seconds
        if self.is_over:
            return
        values = frame.values
        if self._watch is not None:
            values = np.where(self._watch.step(values)[:, None], np.nan, values)
        self._frames.append(values)

    def rest(self, scale: float) -> FloatArray:
        """The actor at rest, shape of a frame; NaN where nothing was observed, or nothing sensible.

        Parameters
        ----------
        scale : float
            The largest standard deviation of a dimension in training: who moves like that does not
            rest, which is warned about.
        """
        frames = np.array(self._frames)
        frames[np.abs(frames) > HUGE] = np.nan
        return median_at_rest(frames.reshape(len(frames), -1), scale).reshape(frames.shape[1:])
