"""Straight lines across gaps in time."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray


def interpolated(X: FloatArray, time: FloatArray) -> FloatArray:
    """Fill gaps along a straight line in time; at both ends with the nearest observation.

    Parameters
    ----------
    X : array, shape (T, d)
        NaN: not observed; every column has an observation.
    time : array, shape (T,)
        Seconds, rising.
    """
    gaps = np.isnan(X).any(axis=0)
    if not gaps.all():  # most columns have none
        filled = X.copy()
        if gaps.any():
            filled[:, gaps] = interpolated(X[:, gaps], time)
        return filled
    rows = np.arange(len(X))[:, None]
    seen = ~np.isnan(X)
    last = np.maximum.accumulate(np.where(seen, rows, -1), axis=0)
    following = np.minimum.accumulate(np.where(seen, rows, len(X))[::-1], axis=0)[::-1]
    before = np.where(last >= 0, last, following)
    after = np.where(following < len(X), following, before)
    span = time[after] - time[before]
    share = np.where(span > 0.0, (time[:, None] - time[before]) / np.where(span > 0, span, 1), 0.0)
    start, end = (np.take_along_axis(X, at, axis=0) for at in (before, after))
    return np.where(seen, X, (1.0 - share) * start + share * end)
