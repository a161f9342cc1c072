"""Markers that stand in each other's place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.preprocess.faults.prediction import predicted

AT_ONCE = 4_000_000
"""Distances, or entries of pairs and frames, that are in memory at once."""
MANY = 200
"""Markers, beyond which a tree of them finds the nearest sooner than all distances do."""
MOST = 0.5
"""Where more of what was seen is suspect, markers move too far to be separated by it."""


@dataclass(frozen=True, eq=False)
class _Crossings:
    """Pairs of markers that may have changed places, and when."""

    pairs: IntArray  # (P, 2)
    # (n,) each: Of every crossing its pair, rising, and its frame
    pair: IntArray
    frame: IntArray

    def rare(self, seen: BoolArray) -> Iterator[tuple[IntArray, IntArray, IntArray]]:
        """In batches of pairs: the pairs (B, 2), and of what is rare of each its row and frame.

        A pair is in one order or the other; in the rarer one, markers may be exchanged.
        """
        frames = len(seen)
        size = max(AT_ONCE // frames, 1)
        for start in range(0, len(self.pairs), size):
            pairs = self.pairs[start : start + size]
            first, last = np.searchsorted(self.pair, [start, start + size])
            turned = np.zeros((len(pairs), frames), dtype=np.bool_)
            turned[self.pair[first:last] - start, self.frame[first:last]] = True
            together = (seen[:, pairs[:, 0]] & seen[:, pairs[:, 1]]).T
            odd = np.logical_xor.accumulate(turned, axis=1) & together
            often = 2 * odd.sum(axis=1) > together.sum(axis=1)
            row, frame = np.nonzero(np.where(often[:, None], together & ~odd, odd))
            yield pairs, row, frame


def exchanged(markers: FloatArray) -> BoolArray:
    """Mask of markers that stand in each other's place for some frames, (T, M).

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.
    """
    seen = ~np.isnan(markers[:, :, 0])
    suspect, swapped = np.zeros_like(seen), np.zeros_like(seen)
    crossings = _crossings(markers)
    for pairs, row, frame in crossings.rare(seen):
        suspect[frame[:, None], pairs[row]] = True
    if not suspect.any() or suspect.sum() > MOST * seen.sum():
        return swapped
    expected = predicted(markers, suspect)
    for pairs, row, frame in crossings.rare(seen):
        here, there = (one[frame[:, None], pairs[row]] for one in (markers, expected))
        as_it_is = np.linalg.norm(here - there, axis=2).sum(axis=1)
        changed = np.linalg.norm(here[:, ::-1] - there, axis=2).sum(axis=1)
        better = _medians(changed, row, len(pairs)) < _medians(as_it_is, row, len(pairs))
        found = better[row]
        swapped[frame[found][:, None], pairs[row[found]]] = True
    return swapped


def _medians(values: FloatArray, row: IntArray, rows: int) -> FloatArray:
    """The median of the values of each row, (rows,); NaN where a row, of those rising, has none."""
    count = np.bincount(row, minlength=rows)
    ordered = values[np.lexsort((values, row))]
    first = np.cumsum(count) - count
    there = count > 0
    middle = np.full(rows, np.nan)
    low, high = first + (count - 1) // 2, first + count // 2
    middle[there] = (ordered[low[there]] + ordered[high[there]]) / 2.0
    return middle


def _crossings(markers: FloatArray) -> _Crossings:
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
    different, pair = np.unique(pairs, axis=0, return_inverse=True)
    both = np.unique(np.stack([pair.ravel(), frames + 1], axis=1), axis=0)
    return _Crossings(different, both[:, 0], both[:, 1])


def _nearest(now: FloatArray, before: FloatArray) -> IntArray:
    """Index of the marker last seen nearest to each marker in each frame, (T, M)."""
    if now.shape[1] > MANY:
        return np.stack([_nearest_by_tree(*one) for one in zip(now, before, strict=True)])
    result = np.empty(now.shape[:2], dtype=np.int64)
    some = max(AT_ONCE // now.shape[1] ** 2, 1)
    for start in range(0, len(now), some):
        here, there = now[start : start + some], before[start : start + some]
        squares = (there**2).sum(axis=2)[:, None, :] - 2.0 * here @ there.transpose(0, 2, 1)
        nearest = np.where(np.isnan(squares), np.inf, squares).argmin(axis=2)
        result[start : start + some] = nearest
    return result


def _nearest_by_tree(now: FloatArray, before: FloatArray) -> IntArray:
    """The same in one frame, (M,), of many markers; 0 for what was not seen."""
    seen, known = ~np.isnan(now[:, 0]), np.flatnonzero(~np.isnan(before[:, 0]))
    result = np.zeros(len(now), dtype=np.int64)
    if len(known):
        result[seen] = known[cKDTree(before[known]).query(now[seen])[1]]
    return result


def _last_seen(markers: FloatArray) -> FloatArray:
    """The last position seen of each marker at each frame, (T, M, 3); NaN before the first."""
    seen = ~np.isnan(markers[:, :, 0])
    last = np.maximum.accumulate(np.where(seen, np.arange(len(markers))[:, None], 0), axis=0)
    return np.take_along_axis(markers, last[:, :, None], axis=0)
