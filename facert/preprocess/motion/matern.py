"""Smooth motion in time: a Gaussian process with the Matérn kernel of order 3/2.

Its correlation over one frame is ρ = (1 + a) exp(-a). Such a process has a velocity; together they
are a Markov chain (Hartikainen and Särkkä 2010), which a recursion over the frames can smooth.
"""

from __future__ import annotations

import numpy as np
from scipy.special import lambertw

from facert.data.arrays import FloatArray

SLOWEST, QUICKEST = 0.02, 4.0
"""Range of a: motion that takes some 100 frames, and hardly any memory from frame to frame."""


def decay(correlation: FloatArray) -> FloatArray:
    """The rate a of processes whose values in neighbouring frames are correlated so, (q,)."""
    inside = np.clip(correlation, 0.0, 1.0 - 1e-6)  # at 1 rounding leaves the range of W
    return np.clip(-1.0 - np.real(lambertw(-inside / np.e, -1)), SLOWEST, QUICKEST)


def transition(a: FloatArray) -> FloatArray:
    """How value and velocity of each process (both of unit variance) go on, (2, 2, q)."""
    return np.asarray(np.exp(-a) * np.array([[1.0 + a, a], [-a, 1.0 - a]]))
