"""Markers that lie elsewhere: too far from where the others put them for skin to go.

A reflection that was taken for a marker, or another marker of the same kind, may stand for it for
seconds, still or moving along with the head, so that neither a jump nor a held value gives it
away. Where the other markers put it does. A distribution of the take predicts that, fitted to what
is not suspect: first, by where each marker lies in the shape of the face, and then anew, as long as
the suspicion lasts. All is relative to the size of the face: what the head does cancels out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.blocks import spread
from facert.mesh.rigid import align
from facert.preprocess.faults.prediction import Expected, expected_of, some_frames
from facert.preprocess.faults.quantiles import median, quantile
from facert.preprocess.faults.runs import whole_runs

FEWEST = 5
"""With fewer markers the rest of the face predicts too little."""
FAR, TIMES = 0.15, 8.0
"""A stray is off by this share of the face's size, the median distance between two markers (some
9 cm, so by 1.3 cm), and by so many times what is usual for its marker. In the real takes, with
noise and head motion, no position was off by more than 0.09."""
ORDINARY, FARTHER = 0.8, 1.5
"""It is also off by so many times how far this share of all positions lie from their usual place in
the face: a small part of its size for skin, but markers may be on other things."""
SURE, FAST = 0.4, 0.95
"""A marker that is off by less than this share of the face's size has strayed only if it leaves, or
comes back, by a step larger than this share of its steps: it may be in an odd pose."""
STRANGE, RARE = 0.3, 3.0
"""At first the distribution is fitted without positions that lie this share of the face's size
away from their usual place, and so many times as far as usual."""
NOISE = 0.01
"""Standard deviation, by the face's size, of what predicts nothing: a short take has chance
relations between a stray and small motion elsewhere."""
FIT = 300
"""Frames that the distribution is fitted to, at most."""
ROUNDS, SEARCHES = 3, 4
"""How often the distribution is fitted anew, and the suspicion of a frame looked at again."""
NEAR_WORST = 0.5
"""A stray draws the predictions of its neighbours along: only what is this near to the worst of its
frame is suspect."""
MOST = 0.8
"""A marker is not suspect in more than this share of the frames."""
OTHERS = 40
"""Markers that distances are taken to, at most."""
DISTANCES, AT_ONCE = 8_000_000, 1_000_000
"""Distances that are taken, of very many markers, and those that are in memory at once."""
MOST_ALIGNED = 600
"""Markers that frames are aligned by, at most."""
PLACED = 2
"""How often the shape is estimated anew."""


@dataclass(frozen=True, eq=False)
class _Expectation:
    """A distribution of the frames, and how far off a position is a stray, (M,)."""

    expected: Expected
    size: float  # Of the face
    limit: FloatArray

    def strays(self, markers: FloatArray, suspect: BoolArray) -> BoolArray:
        """The positions of frames (T, M, 3) that are strays, (T, M), from a first suspicion."""
        for _ in range(SEARCHES):
            relative = self.expected.off(markers, suspect) / self.limit
            worst = relative.max(axis=1, keepdims=True)
            found = (relative > 1.0) & (suspect | (relative >= NEAR_WORST * worst))
            if (found == suspect).all():
                return np.asarray(found)
            suspect = found
        relative = self.expected.off(markers, suspect) / self.limit
        return np.asarray(suspect & (relative > 1.0))

    def unsteady(self, markers: FloatArray, strays: BoolArray) -> BoolArray:
        """The runs of strays that are too far off for any pose, or begin or end with a jump."""
        away = self.expected.off(markers, strays)
        steps = np.linalg.norm(np.diff(markers, axis=0), axis=2)
        steps[strays[1:] | strays[:-1]] = np.nan
        usual = np.nan_to_num(quantile(steps.T, FAST), posinf=0.0)
        jump = np.zeros_like(away)
        jump[1:] = np.abs(np.diff(away, axis=0))
        jump[:-1] = np.maximum(jump[:-1], jump[1:])
        return whole_runs(strays, (away > SURE * self.size) | (jump > usual))


def far_from_expected(markers: FloatArray) -> BoolArray:
    """Mask of positions too far from where the other markers put them, (T, M).

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.
    """
    hidden = np.isnan(markers[:, :, 0])
    strays, ever = np.zeros_like(hidden), np.asarray(~hidden.all(axis=0))
    if len(markers) < 3 or ever.sum() < FEWEST:
        return strays
    if not ever.all():
        strays[:, ever] = far_from_expected(np.ascontiguousarray(markers[:, ever]))
        return strays
    some = markers[some_frames(hidden, FIT)]
    size, change = _distances(some)
    if size > 0.0:
        expectation = _expectation(some, size, change)
        found = expectation.strays(markers, strays)
        return expectation.unsteady(markers, found) if found.any() else found
    return strays


def _expectation(markers: FloatArray, size: float, change: FloatArray) -> _Expectation:
    """The distribution of frames (n, M, 3) without their strays."""
    hidden = np.isnan(markers[:, :, 0])
    away = _away_from_place(markers, ~hidden & ~_strange(change, size))
    least = max(FAR * size, FARTHER * float(np.nanquantile(away, ORDINARY)))
    suspect = _strange(away, size)
    for _ in range(ROUNDS):
        kept = np.where(suspect[:, :, None], np.nan, markers)
        expected = expected_of(kept, NOISE * size)
        away = expected.off(markers, suspect)
        usual = median(np.where(suspect | hidden, np.nan, away).T)
        expectation = _Expectation(expected, size, np.maximum(least, TIMES * usual))
        before, suspect = suspect, expectation.strays(markers, suspect)
        suspect &= (hidden | suspect).mean(axis=0) < MOST  # else nothing would be left of it
        if (suspect == before).all():
            break
    return expectation


def _distances(markers: FloatArray) -> tuple[float, FloatArray]:
    """The size of the face, and how much the distances of each marker differ from usual, (n, M).

    Both are medians over the other markers, which no head motion changes.
    """
    most = max(DISTANCES // (markers.shape[0] * markers.shape[1]), FEWEST)
    others = markers[:, spread(markers.shape[1], min(most, OTHERS))]
    parts = -(-markers.shape[1] * others.shape[0] * others.shape[1] // AT_ONCE)
    found = [_changes(part, others) for part in np.array_split(markers, parts, axis=1)]
    usual = np.concatenate([one for one, _ in found])
    size = float(np.nanmedian(usual[usual > 0.0])) if (usual > 0.0).any() else 0.0
    return size, np.concatenate([change for _, change in found], axis=1)


def _changes(markers: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Usual distances of markers to others, (M, O), and how much they differ from it, (n, M)."""
    squares = (markers**2).sum(axis=2)[:, :, None] + (others**2).sum(axis=2)[:, None]
    squares -= 2.0 * markers @ others.transpose(0, 2, 1)
    distances = np.sqrt(np.maximum(squares, 0.0))
    usual = median(distances.transpose(1, 2, 0))
    return usual, median(np.abs(distances - usual))


def _away_from_place(markers: FloatArray, kept: BoolArray) -> FloatArray:
    """Distances of frames (n, M, 3) from the usual places in the face, by what is kept (n, M)."""
    shape = markers[kept.sum(axis=1).argmax()]
    for _ in range(PLACED):
        known = np.flatnonzero(~np.isnan(shape[:, 0]))
        known = known[spread(len(known), MOST_ALIGNED)]
        motion = align(shape[known], markers[:, known], kept[:, known].astype(np.float64))
        placed = motion.undo(markers)
        shape = median(placed.transpose(1, 2, 0))
    return np.asarray(np.linalg.norm(placed - shape, axis=2))


def _strange(change: FloatArray, size: float) -> BoolArray:
    """Changes of frames (n, M) that are large and rare."""
    return np.asarray(change > np.maximum(STRANGE * size, RARE * median(change.T)))
