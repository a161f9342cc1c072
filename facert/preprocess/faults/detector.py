"""Live fault detection: from the frames so far, one after the other."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray

HELD = 5
"""Live, a marker is held that repeats its position so often while most others move; rounded
positions repeat now and then as well."""


class FaultDetector:
    """Bad markers of a live stream, from the frames so far: zero and frozen ones.

    Parameters
    ----------
    markers : int
        Number of markers.
    """

    def __init__(self, markers: int) -> None:
        self._last = np.full((markers, 3), np.nan)
        self._none: BoolArray = np.zeros(markers, dtype=np.bool_)
        self._repeats: IntArray = np.zeros(markers, dtype=np.int64)

    def step(self, markers: FloatArray) -> BoolArray:
        """The bad markers (M,) of one more frame (M, 3); NaN: not observed."""
        repeated, last = markers == self._last, self._last
        self._last = np.where(np.isnan(markers), last, markers)
        if markers.all() and not repeated.any():  # as nearly always
            self._repeats = np.zeros_like(self._repeats)
            return self._none
        zero = (markers == 0.0).all(axis=1)
        same = repeated.all(axis=1)
        whole = same.sum() > np.count_nonzero(~np.isnan(markers[:, 0])) / 2
        # A whole frame that repeats was sent twice, or the face rests.
        self._repeats = np.where(same, self._repeats + (not whole), 0)
        return np.asarray(zero | (same & (self._repeats >= HELD)))
