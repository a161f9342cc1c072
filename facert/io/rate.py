"""The nominal frame rate of recordings that do not state one."""

from __future__ import annotations

import numpy as np

from facert.data import FloatArray

ONE_FRAME = 30.0
"""What a single frame is said to run at."""


def nominal_rate(time: FloatArray) -> float:
    """Frames a second by the usual spacing of the frames; whole where that is within 1 %.

    Parameters
    ----------
    time : array, shape (T,)
        Rising seconds, with or without gaps.
    """
    if len(time) < 2:
        return ONE_FRAME
    rate = 1.0 / float(np.median(np.diff(time)))
    whole = float(np.rint(rate))
    return whole if abs(rate - whole) <= 0.01 * rate else rate
