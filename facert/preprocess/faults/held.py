"""Markers that are held at a repeated position while others move."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.blocks import blocks

UNLIKELY = 1e-5
"""A run of repeats whose chance is less than this is a held value."""
SLOW = 0.1
"""This share of a marker's steps are so small that it may have been at rest before."""
ROUNDED = 3.0
"""Rounding makes steps of this many times the smallest one."""


def held_values(markers: FloatArray) -> BoolArray:
    """Mask of markers held at a repeated position beyond chance, (T, M).

    The chance of a repeat is the share of the other markers that repeat in the same frame (all do
    in a doubled frame), or the share of repeats after frames in which this marker moved, if that
    is more (rounded positions repeat now and then), but never less than one in T. A marker that
    goes on from where it was, by a step among its smallest, was at rest, or might as well
    have been.

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.
    """
    frames = len(markers)
    steps = np.full(markers.shape[:2], np.nan)
    for rows in blocks(frames - 1, markers[0].size):
        step = np.abs(markers[1:][rows] - markers[:-1][rows])
        steps[1:][rows] = np.maximum(np.maximum(step[:, :, 0], step[:, :, 1]), step[:, :, 2])
    both, repeats = ~np.isnan(steps), steps == 0.0
    moved = both & ~repeats
    if not moved.any() or not repeats.any():
        return np.zeros_like(repeats)
    began = repeats[1:] & moved[:-1]
    own = began.sum(axis=0) / np.maximum(moved.sum(axis=0), 1)
    others = (repeats.sum(axis=1, keepdims=True) - repeats) / np.maximum(
        both.sum(axis=1, keepdims=True) - both, 1
    )
    chance = np.clip(np.maximum(others, own), 1.0 / max(frames, 2), 1.0)
    surprise = _total_of_run(np.where(repeats, -np.log(chance), 0.0), repeats)
    return np.asarray(repeats & (surprise > -np.log(UNLIKELY)) & _released_far(steps))


def _released_far(steps: FloatArray) -> BoolArray:
    """Repeats that end in a step that is not among the smallest, or never, (T, M)."""
    moving = np.where(steps > 0.0, steps, np.nan)
    moves = ~np.isnan(moving).all(axis=0)
    ordinary = np.zeros(steps.shape[1])
    ordinary[moves] = np.nanquantile(moving[:, moves], SLOW, axis=0)
    ordinary = np.maximum(ordinary, ROUNDED * np.nanmin(moving))
    release = np.full_like(steps, np.inf)
    release[:-1] = np.where(np.isnan(steps[1:]), np.inf, steps[1:])
    following = _next_known(np.where(release == 0.0, np.nan, release))
    return np.asarray(following > ordinary)


def _total_of_run(values: FloatArray, runs: BoolArray) -> FloatArray:
    """The sum of values over the run of True in time that each entry belongs to, (T, M)."""
    total = np.cumsum(values, axis=0)
    before = np.maximum.accumulate(np.where(runs, 0.0, total), axis=0)
    ends = runs & ~np.concatenate([runs[1:], np.zeros_like(runs[:1])])
    return np.asarray(np.where(runs, _next_known(np.where(ends, total - before, np.nan)), 0.0))


def _next_known(values: FloatArray) -> FloatArray:
    """The next value from each row on that is not NaN, down each column; NaN after the last."""
    last = len(values) - 1
    rows = np.where(np.isnan(values), last, np.arange(len(values))[:, None])
    return np.take_along_axis(values, np.minimum.accumulate(rows[::-1], axis=0)[::-1], axis=0)
