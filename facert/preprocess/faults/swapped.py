"""Markers that stand in each other's place."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.preprocess.faults.prediction import predicted

DISTANCES_AT_ONCE = 4_000_000


def exchanged(markers: FloatArray) -> BoolArray:
    """Mask of markers that stand in each other's place for some frames, (T, M).

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.
    """
    suspect = np.zeros(markers.shape[:2], dtype=np.bool_)
    pairs = []
    for first, second, frames in _crossings(markers):
        together = ~np.isnan(markers[:, [first, second], 0]).any(axis=1)
        odd = np.cumsum(np.bincount(frames, minlength=len(markers))) % 2 == 1
        odd &= together
        rare = odd if odd.sum() <= together.sum() / 2 else together & ~odd
        if rare.any():
            suspect[rare, first] = suspect[rare, second] = True
            pairs.append((first, second, rare))
    if not pairs:
        return suspect
    expected = predicted(np.where(suspect[:, :, None], np.nan, markers))
    swapped = np.zeros_like(suspect)
    for first, second, rare in pairs:
        here, there = markers[rare][:, [first, second]], expected[rare][:, [first, second]]
        as_it_is = np.linalg.norm(here - there, axis=2).sum(axis=1)
        changed = np.linalg.norm(here[:, ::-1] - there, axis=2).sum(axis=1)
        if np.median(changed) < np.median(as_it_is):
            swapped[rare, first] = swapped[rare, second] = True
    return swapped


def _crossings(markers: FloatArray) -> list[tuple[int, int, IntArray]]:
    """Pairs of markers each of which comes nearest to where the other was, and in which frames.

    One of the two may be hidden just then.
    """
    now = markers[1:]
    came_from = _nearest(now, _last_seen(markers)[:-1])
    back = np.take_along_axis(came_from, came_from, axis=1)
    own, seen = np.arange(markers.shape[1]), ~np.isnan(now[:, :, 0])
    hidden = ~np.take_along_axis(seen, came_from, axis=1)
    frames, one = np.nonzero(seen & (came_from != own) & (hidden | (back == own)))
    pairs = np.sort(np.stack([one, came_from[frames, one]], axis=1), axis=1)
    return [
        (int(first), int(second), np.unique(frames[(pairs == (first, second)).all(axis=1)]) + 1)
        for first, second in np.unique(pairs, axis=0)
    ]


def _nearest(now: FloatArray, before: FloatArray) -> IntArray:
    """Index of the marker last seen nearest to each marker in each frame, (T, M)."""
    result = np.empty(now.shape[:2], dtype=np.int64)
    some = max(DISTANCES_AT_ONCE // now.shape[1] ** 2, 1)
    for start in range(0, len(now), some):
        here, there = now[start : start + some], before[start : start + some]
        squares = (there**2).sum(axis=2)[:, None, :] - 2.0 * here @ there.transpose(0, 2, 1)
        nearest = np.where(np.isnan(squares), np.inf, squares).argmin(axis=2)
        result[start : start + some] = nearest
    return result


def _last_seen(markers: FloatArray) -> FloatArray:
    """The last position seen of each marker at each frame, (T, M, 3); NaN before the first."""
    seen = ~np.isnan(markers[:, :, 0])
    last = np.maximum.accumulate(np.where(seen, np.arange(len(markers))[:, None], 0), axis=0)
    return np.take_along_axis(markers, last[:, :, None], axis=0)
