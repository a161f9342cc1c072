"""Frames in time: the noise of a capture, straight lines across gaps, steps, an even grid."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.blocks import blocks, spread

GAUSSIAN = 0.6744897501960817
"""Half of all draws of a standard normal variable are nearer to zero than this."""
ORDINARY = 0.9
"""This share of the steps from frame to frame is no gap."""
COLUMNS = 1200
"""Of more columns, the noise of so many is that of all."""
LONGEST = 60
"""Frames; after a longer gap in time a face may be anywhere, so none is taken to be longer."""


def capture_noise(X: FloatArray) -> float:
    """σ, the standard deviation of the noise of a coordinate, from second differences in time.

    White noise gives x_{t-1} - 2 x_t + x_{t+1} a variance of 6 σ²; motion, most of the time, hardly
    any. The median of the absolute values of each column passes over moments of fast motion, and
    the median over the columns, of many evenly spread ones, over what is always in motion.

    Parameters
    ----------
    X : array, shape (T, d)
        Frames; NaN: not observed.

    Returns
    -------
    float
        In the units of X; 0 where no three frames in a row were observed.
    """
    bends = np.abs(np.diff(X[:, spread(X.shape[1], COLUMNS)], 2, axis=0))
    known = ~np.isnan(bends).all(axis=0) if len(bends) else np.zeros(bends.shape[1], dtype=np.bool_)
    if not known.any():
        return 0.0
    typical = float(np.median(np.nanmedian(bends[:, known], axis=0)))
    return typical / GAUSSIAN / float(np.sqrt(6.0))


def interpolated(X: FloatArray, time: FloatArray) -> FloatArray:
    """Fill gaps along a straight line in time; at both ends with the nearest observation.

    Parameters
    ----------
    X : array, shape (T, d)
        NaN: not observed; every column has an observation.
    time : array, shape (T,)
        Seconds, rising.
    """
    filled, hidden = X.copy(), np.isnan(X)
    column, row = np.nonzero(hidden.T)  # column by column, rows rising: gaps are runs of these
    begins, ends = (np.ones(len(row), dtype=np.bool_) for _ in range(2))
    begins[1:] = ends[:-1] = (np.diff(row) > 1) | (np.diff(column) > 0)
    before, after, gap = row[begins] - 1, row[ends] + 1, np.cumsum(begins) - 1
    start, end = before < 0, after == len(X)
    before[start], after[end] = after[start], before[end]
    low, high = X[before, column[begins]], X[after, column[begins]]
    steps = np.where(start | end, 1.0, time[after] - time[before])
    slope = (high - low) / steps
    filled[row, column] = low[gap] + slope[gap] * (time[row] - time[before[gap]])
    return filled


def largest_step(X: FloatArray, sigma: float = 0.0) -> float:
    """RMS step from frame to frame of the column that moves most, less what is noise.

    Parameters
    ----------
    X : array, shape (T, d)
        NaN: not observed.
    sigma : float
        Standard deviation of the capture noise.
    """
    largest = 0.0
    for columns in blocks(X.shape[1], len(X)):
        squares = np.diff(X[:, columns], axis=0) ** 2
        known = ~np.isnan(squares)
        means = np.where(known, squares, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        largest = max(largest, float(means.max(initial=0.0)))
    return float(np.sqrt(max(largest - 2.0 * sigma**2, sigma**2)))


def even_grid(time: FloatArray) -> tuple[IntArray, float]:
    """Indices (T,) of frames on an even grid, and its step in seconds: a typical one.

    Parameters
    ----------
    time : array, shape (T,)
        Seconds, rising. Gaps longer than `LONGEST` frames are cut short.
    """
    steps = np.diff(time)
    if not len(steps):
        return np.zeros(1, dtype=np.int64), 1.0
    # Not the median: packets may come in bursts.
    step = float(np.sort(steps)[: max(int(ORDINARY * len(steps)), 1)].mean())
    passed = np.clip(np.round(steps / step), 1, LONGEST)
    return np.concatenate([[0], np.cumsum(passed)]).astype(np.int64), step
