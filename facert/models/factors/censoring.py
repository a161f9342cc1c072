"""Poses at a limit are censored: the model of Tobin (1958) for the controls of a rig.

A control that ends at 0 or 1 spends much of a performance there, half of the time in some rigs. A
linear model bends itself in vain to predict exactly 0 in all those frames. So the pose is taken to
be a *free* pose clipped to its limits,

    y = min(max(y*, low), high),      y* ~ N(m, s²):

an entry at its limit stands for any y* beyond, whose mean and variance follow from the model m, s,
and the expectation of y is the mean of the clipped y*.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtr

from facert.data.arrays import BoolArray, FloatArray, IntArray

# A control is censored at a limit where at least so much of all poses lies exactly there, and more
# than one: some pose is always the lowest.
LEAST_SHARE = 0.2
LEAST_COUNT = 2
TOLERANCE = 1e-9  # relative to the range: "exactly"
NO_LIMIT = 1e100  # standard deviations: what a limit so far away takes from a pose is 0 exactly
LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class CensoringLimits:
    """Limits at which poses pile up, a pair a control; infinite where they do not."""

    # (d_y,)
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, poses: FloatArray) -> CensoringLimits:
        """Limits at which poses (n, d_y) pile up."""
        low, high = poses.min(axis=0), poses.max(axis=0)
        slack = TOLERANCE * (high - low)
        moves = high > low
        least = max(LEAST_SHARE * len(poses), LEAST_COUNT)
        at_low = moves & (np.sum(poses <= low + slack, axis=0) >= least)
        at_high = moves & (np.sum(poses >= high - slack, axis=0) >= least)
        return cls(np.where(at_low, low, -np.inf), np.where(at_high, high, np.inf))


class ClippedMean:
    """The mean E[y] of free poses y* ~ N(m, s²) clipped to limits.

    With r(t) = E[max(t + s ε, 0)] = t Φ(t/s) + s φ(t/s), it is m + r(low - m) - r(m - high).

    Parameters
    ----------
    limits : CensoringLimits
    std : array, shape (d_y,)
        s.
    """

    def __init__(self, limits: CensoringLimits, std: FloatArray) -> None:
        # low - m and m - high are the same with other signs.
        self._signed_std = np.array([[[1.0]], [[-1.0]]]) * std
        ends = np.stack([limits.low, limits.high])[:, None]
        self._ends = np.clip(ends, -NO_LIMIT * std, NO_LIMIT * std)

    def __call__(self, mean: FloatArray) -> FloatArray:
        """E[y] of free poses with mean (T, d_y)."""
        t = (self._ends - mean) / self._signed_std  # (2, T, d_y)
        taken = np.exp(-0.5 * (t * t + LOG_2PI))
        taken += t * ndtr(t)
        taken *= self._signed_std
        expected: FloatArray = mean + taken[0]
        expected += taken[1]
        return expected


@dataclass(frozen=True, eq=False)
class CensoredPoses:
    """Poses, and which of their entries are at a limit."""

    values: FloatArray  # (n, d_y)
    sign: FloatArray  # (c,): Of each entry at a limit: 1 at the lower, -1 at the upper one
    # (c,): Where it is
    rows: IntArray
    columns: IntArray

    @classmethod
    def of(cls, poses: FloatArray, limits: CensoringLimits) -> CensoredPoses:
        """Find the entries of poses (n, d_y) that are at or beyond a limit."""
        slack = TOLERANCE * np.ptp(poses, axis=0, keepdims=True) if len(poses) else 0.0
        low: BoolArray = poses <= limits.low + slack
        high: BoolArray = poses >= limits.high - slack
        rows, columns = np.nonzero(low | high)
        return cls(poses, np.where(low[rows, columns], 1.0, -1.0), rows, columns)

    def free(self, mean: FloatArray, std: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The expected free poses under a model, (n, d_y), and their summed variances, (d_y,).

        Parameters
        ----------
        mean : array, shape (n, d_y)
        std : array, shape (d_y,)
        """
        values = self.values.copy()
        at = self.rows, self.columns
        s = std[self.columns]
        expected, variance = _below(self.sign * mean[at], s, self.sign * values[at])
        values[at] = self.sign * expected
        total = np.bincount(self.columns, variance, minlength=values.shape[1])
        return values, np.asarray(total, dtype=np.float64)


def _below(mean: FloatArray, std: FloatArray, limit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of N(mean, std²) given that it is at most `limit`."""
    a = (limit - mean) / std
    ratio = np.exp(-0.5 * (a * a + LOG_2PI) - log_ndtr(a))  # φ(a)/Φ(a)
    return mean - std * ratio, std**2 * np.maximum(1.0 - a * ratio - ratio**2, 0.0)
