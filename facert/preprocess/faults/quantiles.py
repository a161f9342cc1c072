"""Quantiles of what was observed, without warnings where nothing was."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray


def quantile(values: FloatArray, share: float) -> FloatArray:
    """The quantile over the last axis of what is not NaN; NaN where nothing is."""
    ordered = np.sort(values, axis=-1)  # NaN comes last
    last = np.maximum((~np.isnan(values)).sum(axis=-1)[..., None] - 1, 0)
    low, high = np.floor(share * last), np.ceil(share * last)
    ends = [np.take_along_axis(ordered, end.astype(np.int64), axis=-1) for end in (low, high)]
    return np.asarray((ends[0] + ends[1])[..., 0] / 2.0)


def median(values: FloatArray) -> FloatArray:
    """The median over the last axis of what is not NaN; NaN where nothing is."""
    return quantile(values, 0.5)
