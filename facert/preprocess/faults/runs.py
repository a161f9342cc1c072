"""Runs in time of the entries of a mask."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, IntArray


def numbered(mask: BoolArray) -> IntArray:
    """The number of the run down its column that each entry belongs to, (T, M): from 1; else 0."""
    began = mask.copy()
    began[1:] &= ~mask[:-1]
    return np.where(mask, np.cumsum(began.T.ravel()).reshape(mask.T.shape).T, 0)


def whole_runs(mask: BoolArray, chosen: BoolArray) -> BoolArray:
    """The runs in time of a mask (T, M) of which an entry is chosen."""
    number = numbered(mask)
    return np.asarray(mask & np.isin(number, number[mask & chosen]))


def beside(mask: BoolArray) -> BoolArray:
    """Entries of which the one in the frame before or after is in a mask (T, M)."""
    result = np.zeros_like(mask)
    result[1:] |= mask[:-1]
    result[:-1] |= mask[1:]
    return result
