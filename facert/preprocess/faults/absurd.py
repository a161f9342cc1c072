"""Values that nothing in the take is like: positions and weights many times too far off.

Programs write -1, -100 or 9999 for what they did not see; and a bit that fell over makes a weight
of 1e9. A whole column of such numbers has another unit, which is for others to say.
"""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.blocks import blocks, spread
from facert.preprocess.faults.quantiles import median, quantile
from facert.preprocess.faults.runs import numbered, whole_runs

NOWHERE = 100.0
"""No marker is farther from the middle of the others than so many times what half of them are."""
AWAY = 5.0
"""A coordinate this far away is one that a program writes, if it is the same each time."""
NATURAL = (1.0, 100.0)
"""Weights are shares, or percent; or angles."""
WITHIN = 2.5
"""Of these units: what most weights are within."""
REACH = 3.0
"""A weight is so many units from the middle of its column at most, unless by a steady motion."""
BRIEF = 2
"""Frames, at most, of a motion that is not steady."""
NEAR = 0.25
"""A jump begins at this share of its height at most."""
BELOW, GAP = -0.5, 0.75
"""In units: a weight that is written for none is lower than this, or out of reach, and so far from
all others, or by this share of the range of these."""
WRITTEN = 2
"""So many such weights are looked for on either side."""
VARIED = 10
"""The others have at least so many values: a weight of two values may be a switch."""
LOOKED_AT, MANY = 600, 1_000_000
"""Of more markers, the middle is found from so many; and, of very many positions, those of as many
frames how far markers usually are from it."""
USUAL, MOST = 0.75, 0.98
"""Quantiles of a column of weights, and of columns in general."""


def absurd_positions(markers: FloatArray) -> BoolArray:
    """Mask of positions where no marker can be, (T, M).

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.
    """
    frames, count = markers.shape[:2]
    some = spread(count, LOOKED_AT)
    centre = median(markers[:, some].transpose(0, 2, 1))[:, None]
    farthest = np.empty((frames, count))
    for rows in blocks(frames, 3 * count):
        away = np.abs(markers[rows] - centre[rows])
        farthest[rows] = np.maximum(np.maximum(away[:, :, 0], away[:, :, 1]), away[:, :, 2])
    hidden = np.isnan(farthest)
    np.nan_to_num(farthest, copy=False)
    if not farthest.any():
        return np.zeros(farthest.shape, dtype=np.bool_)
    looked_at = farthest[spread(frames, LOOKED_AT)][:, some] if farthest.size > MANY else farthest
    usual = float(np.median(looked_at[looked_at > 0.0]))
    result = np.asarray(farthest > NOWHERE * usual)
    suspect = np.flatnonzero((farthest > AWAY * usual).any(axis=0))
    positions = markers[:, suspect]
    far = np.nan_to_num(np.abs(positions - centre)) > AWAY * usual
    highest = np.where(far, positions, -np.inf).max(axis=0)
    same = highest == np.where(far, positions, np.inf).min(axis=0)
    result[:, suspect] |= (far & same).any(axis=2)
    at_centre = (farthest == 0.0) & ~hidden
    return np.asarray(result | (at_centre & (2 * at_centre.sum(axis=1, keepdims=True) > count)))


def absurd_weights(weights: FloatArray) -> BoolArray:
    """Mask of weights that are far out of the range of the others, (T, D).

    Parameters
    ----------
    weights : array, shape (T, D)
        NaN: not observed.
    """
    left = weights
    for _ in range(WRITTEN):
        left = np.where(_written_for_none(left, -BELOW), np.nan, left)
        left = np.where(_written_for_none(-left, REACH), np.nan, left)
    return np.asarray((np.isnan(left) & ~np.isnan(weights)) | _out_of_reach(left))


def _units(weights: FloatArray) -> FloatArray:
    """What the weights of each column are counted in, (D,)."""
    away = np.abs(weights - median(weights.T)).T
    own, reach = np.nan_to_num(quantile(away, USUAL)), np.nan_to_num(quantile(away, MOST))
    usual = np.maximum(own, np.median(reach[reach > 0.0]) if reach.any() else 0.0)
    share, percent = NATURAL
    counted = np.where(usual <= WITHIN * percent, percent, usual)
    return np.where(usual <= WITHIN * share, share, counted)


def _written_for_none(weights: FloatArray, below: float) -> BoolArray:
    """The lowest weights of each column, where all are the same, far below what varies, (T, D).

    They are `below` so many units.
    """
    known = np.where(np.isnan(weights), np.inf, weights)
    lowest = known.min(axis=0)
    found = known == lowest
    others = np.where(found | np.isnan(weights), np.nan, weights)
    ordered, unit = np.sort(others, axis=0), _units(others)
    values = (np.diff(ordered, axis=0) > 0.0).sum(axis=0) + 1
    varied = (values >= min(VARIED, len(weights) // 2)) & (found.sum(axis=0) > 1)
    low, high = ordered[0], quantile(others.T, 1.0)
    gap = low - lowest >= GAP * np.maximum(unit, high - low)
    return np.asarray(found & varied & gap & (lowest < -below * unit))


def _out_of_reach(weights: FloatArray) -> BoolArray:
    """Weights beyond the reach of their column, which no steady motion leads to, (T, D)."""
    away, unit = np.nan_to_num(np.abs(weights - median(weights.T))), _units(weights)
    beyond = away > REACH * unit
    if not beyond.any():
        return beyond
    number = numbered(beyond)
    length = np.bincount(number.ravel())[number]
    changes = np.zeros_like(beyond)
    changes[1:] = beyond[1:] & beyond[:-1] & (np.diff(weights, axis=0) != 0.0)
    steady = (whole_runs(beyond, changes) & (length > BRIEF)) | _led_to(beyond, away)
    habit = np.where(steady, away, 0.0).max(axis=0)  # how far the column goes in earnest
    return np.asarray(beyond & ~steady & (away > REACH * np.maximum(unit, habit)))


def _led_to(beyond: BoolArray, away: FloatArray) -> BoolArray:
    """Runs of weights beyond their reach with a weight beside them that is on the way, (T, D)."""
    outside = np.where(beyond, 0.0, away)
    near = np.zeros_like(away)
    near[1:] = outside[:-1]
    near[:-1] = np.maximum(near[:-1], outside[1:])
    return whole_runs(beyond, near > NEAR * away)
