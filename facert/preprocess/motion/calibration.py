"""How far off what was filled in is, beside what is told of it.

Factors that were learned from a take know too little of how wrong they are: where a region is
hidden, what would have told its own motion is hidden as well. So the take is asked. Its gaps are
hidden once more half a take later, where the same markers were seen; what a motion that was learned
without these says there is compared with what was seen.
"""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.preprocess.motion.motion import Motion

LEAST = 100
"""Numbers to compare, at least."""
WINDOW = 1000
"""Frames that are compared, at most."""
RANGE = (1.0, 10.0)
"""Of the answer: a take that happens to have been easy half a take later proves nothing."""


def error_of_filling(X: FloatArray, sigma: float, seconds: float) -> float:
    """Errors at what is hidden, relative to the standard deviations that are told of them.

    Parameters
    ----------
    X : array, shape (T, d)
        Normalised frames, evenly spaced in time; NaN: not observed. Every column was seen.
    sigma : float
        Standard deviation of the capture noise.
    seconds : float
        From frame to frame.

    Returns
    -------
    float
        1 at least, and where the take has too few gaps to tell.
    """
    hidden = np.isnan(X)
    again = np.roll(hidden, len(X) // 2, axis=0) & ~hidden
    again[:, (hidden | again).all(axis=0)] = False
    window = _busiest(again)
    compared = again[window]
    if np.count_nonzero(compared) < LEAST:
        return 1.0
    given = np.where(again, np.nan, X)
    mean, variance = Motion.learned(given, sigma, seconds).smooth(given[window], sigma)
    square = float(np.mean((mean - X[window])[compared] ** 2)) - sigma**2
    told = float(np.mean(variance[compared]))
    return float(np.clip(np.sqrt(max(square, 0.0) / told), *RANGE))


def _busiest(marked: BoolArray) -> slice:
    """The stretch of frames (T, d) with most that is marked."""
    totals = np.concatenate([[0], np.cumsum(marked.sum(axis=1))])
    length = min(WINDOW, len(marked))
    start = int(np.argmax(totals[length:] - totals[: len(totals) - length]))
    return slice(start, start + length)
