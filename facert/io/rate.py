"""The nominal frame rate of recordings that do not state one."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray

ONE_FRAME = 30.0
"""What a single frame is said to run at."""


def nominal_rate(time: FloatArray) -> float:
    """Frames a second by the usual spacing of the frames; whole where that is within 1 %.

    Parameters
    ----------
    time : array, shape (T,)
        Rising seconds, with or without gaps. Of anything else `ONE_FRAME` is said: a `Take` of
        such times is refused.
    """
    if time.ndim != 1 or len(time) < 2 or not (time[1:] > time[:-1]).all():
        return ONE_FRAME
    rate = 1.0 / float(np.median(np.diff(time)))
    whole = float(np.rint(rate))
    return whole if abs(rate - whole) <= 0.01 * rate else rate
