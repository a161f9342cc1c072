"""Markers that stand in each other's place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from facert.data.arrays import BoolArray, FloatArray, IntArray, lengths
from facert.data.blocks import blocks, spread
from facert.preprocess.faults.prediction import predicted
from facert.preprocess.faults.quantiles import median

AT_ONCE = 4_000_000
"""Distances, or entries of pairs and frames, that are in memory at once."""
MANY, AROUND = 200, 8
"""Of more markers, only the nearest so many are looked at: farther away, a marker has strayed."""
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
    count = markers.shape[1]
    frame, one, other = _moved(markers)
    number = (frame * count + one) * count + other
    back = np.isin(number, (frame * count + other) * count + one)
    crossed = back | np.isnan(markers[frame, other, 0])
    pairs = np.sort(np.stack([one[crossed], other[crossed]], axis=1), axis=1)
    different, pair = np.unique(pairs, axis=0, return_inverse=True)
    both = np.unique(np.stack([pair.ravel(), frame[crossed]], axis=1), axis=0)
    return _Crossings(different, both[:, 0], both[:, 1])


def _moved(markers: FloatArray) -> tuple[IntArray, IntArray, IntArray]:
    """Frames in which a marker comes nearest to where another was, that marker, and the other."""
    nearest = _Neighbours.of(markers).nearest if markers.shape[1] > MANY else _nearest
    found, last = [np.empty((3, 0), dtype=np.int64)], markers[0]
    for rows in blocks(len(markers) - 1, max(markers.shape[1], MANY) ** 2 // 8, AT_ONCE):
        now = markers[1:][rows]
        seen = _last_seen(np.concatenate([last[None], now]))
        frame, one, other = nearest(now, seen[:-1])
        found.append(np.stack([frame + rows.start + 1, one, other]))
        last = seen[-1]
    frame, one, other = np.concatenate(found, axis=1)
    return frame, one, other


def _nearest(now: FloatArray, before: FloatArray) -> tuple[IntArray, IntArray, IntArray]:
    """The same for a few frames and those before, (T, M, 3) each, by all distances."""
    squares = (before**2).sum(axis=2)[:, None, :] - 2.0 * now @ before.transpose(0, 2, 1)
    other = np.where(np.isnan(squares), np.inf, squares).argmin(axis=2)
    own, seen = np.arange(now.shape[1]), ~np.isnan(now[:, :, 0])
    frame, one = np.nonzero(seen & (other != own))
    return frame, one, other[frame, one]


@dataclass(frozen=True, eq=False)
class _Neighbours:
    """Each of many markers with those that usually lie around it: others are not looked at."""

    around: IntArray  # (M, K)
    spacing: FloatArray  # (M,): The distance to the nearest

    @classmethod
    def of(cls, markers: FloatArray) -> _Neighbours:
        """The neighbours in a frame (T, M, 3) that shows most markers."""
        shape = markers[(~np.isnan(markers[:, :, 0])).sum(axis=1).argmax()]
        known = np.flatnonzero(~np.isnan(shape[:, 0]))
        found = cKDTree(shape[known]).query(shape[known], min(AROUND + 1, len(known)))
        distance, near = np.asarray(found[0]), np.asarray(found[1])
        around = np.tile(np.arange(len(shape))[:, None], (1, near.shape[1]))
        around[known], spacing = known[near], np.full(len(shape), np.inf)
        spacing[known] = distance[:, 1]
        return cls(around, spacing)

    def nearest(self, now: FloatArray, before: FloatArray) -> tuple[IntArray, IntArray, IntArray]:
        """As `_nearest`, of markers that move, relative to all, by half the distance to another."""
        some = spread(now.shape[1], MANY)
        away = now - before
        away -= median(away[:, some].transpose(0, 2, 1))[:, None]
        frame, one = np.nonzero(lengths(away) > self.spacing / 2.0)
        around = self.around[one]
        there = before[frame[:, None], around] - now[frame, one][:, None]
        squares = np.nan_to_num(np.einsum("nki,nki->nk", there, there), nan=np.inf)
        other = around[np.arange(len(one)), squares.argmin(axis=1)]
        moved = other != one
        return frame[moved], one[moved], other[moved]


def _last_seen(markers: FloatArray) -> FloatArray:
    """The last position seen of each marker at each frame, (T, M, 3); NaN before the first."""
    hidden = np.isnan(markers[:, :, 0])
    if not hidden.any():
        return markers
    last = np.where(hidden, 0, np.arange(len(markers))[:, None])
    last = np.maximum.accumulate(last, axis=0)
    return np.take_along_axis(markers, last[:, :, None], axis=0)
