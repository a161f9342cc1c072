"""Bad markers of a live stream, told from the frames so far; `detection` knows those to come."""

from __future__ import annotations

import numpy as np

from facert.data import BoolArray, FloatArray, IntArray

HELD = 5
"""A marker that repeats its position so often, while most of the others move, is held; rounded
positions repeat now and then as well."""


class MarkerWatch:
    """Hides markers at exactly (0, 0, 0), and held ones."""

    def __init__(self) -> None:
        self._last: FloatArray | None = None
        self._repeats: IntArray = np.zeros(0, dtype=np.int64)

    def step(self, markers: FloatArray) -> BoolArray:
        """Which markers (M,) of one more frame (M, 3) are bad; NaN: not observed."""
        zero = (markers == 0.0).all(axis=1)
        if self._last is None:
            self._last, self._repeats = markers.copy(), np.zeros(len(markers), dtype=np.int64)
            return np.asarray(zero)
        seen = ~np.isnan(markers[:, 0])
        same = seen & (markers == self._last).all(axis=1)
        whole = same.sum() > seen.sum() / 2  # the whole frame is a repeat, or the face rests
        self._repeats = np.where(same, self._repeats + (not whole), 0)
        self._last = np.where(seen[:, None], markers, self._last)
        return np.asarray(zero | (same & (self._repeats >= HELD)))
