"""Bad markers of a live stream, told from the frames so far; `detection` knows those to come."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray

HELD = 5
"""A marker that repeats its position so often, while most of the others move, is held; rounded
positions repeat now and then as well."""


class MarkerWatch:
    """Hides markers at exactly (0, 0, 0), and held ones.

    Parameters
    ----------
    markers : int
        How many there are.
    """

    def __init__(self, markers: int) -> None:
        self._last = np.full((markers, 3), np.nan)
        self._none: BoolArray = np.zeros(markers, dtype=np.bool_)
        self._repeats: IntArray = np.zeros(markers, dtype=np.int64)

    def step(self, markers: FloatArray) -> BoolArray:
        """Which markers (M,) of one more frame (M, 3) are bad; NaN: not observed."""
        repeated, last = markers == self._last, self._last
        self._last = np.where(np.isnan(markers), last, markers)
        if markers.all() and not repeated.any():  # as nearly always
            self._repeats = np.zeros_like(self._repeats)
            return self._none
        zero = (markers == 0.0).all(axis=1)
        same = repeated.all(axis=1)
        whole = same.sum() > np.count_nonzero(~np.isnan(markers[:, 0])) / 2
        # Of a whole frame that is a repeat nothing is told: it was sent twice, or the face rests.
        self._repeats = np.where(same, self._repeats + (not whole), 0)
        return np.asarray(zero | (same & (self._repeats >= HELD)))
