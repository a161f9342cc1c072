"""How much noise a capture has."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray

GAUSSIAN = 0.6744897501960817
"""Half of all draws of a standard normal variable are nearer to zero than this."""


def capture_noise(X: FloatArray) -> float:
    """σ, the standard deviation of the noise of a coordinate, from second differences in time.

    White noise gives x_{t-1} - 2 x_t + x_{t+1} a variance of 6 σ²; motion, most of the time, hardly
    any. The median of the absolute values of each column passes over moments of fast motion, and
    the median over the columns over what is always in motion.

    Parameters
    ----------
    X : array, shape (T, d)
        Frames; NaN: not observed.

    Returns
    -------
    float
        In the units of X; 0 where no three frames in a row were observed.
    """
    bends = np.abs(np.diff(X, 2, axis=0))
    known = ~np.isnan(bends).all(axis=0) if len(bends) else np.zeros(X.shape[1], dtype=np.bool_)
    if not known.any():
        return 0.0
    typical = float(np.median(np.nanmedian(bends[:, known], axis=0)))
    return typical / GAUSSIAN / float(np.sqrt(6.0))
