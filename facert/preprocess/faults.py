"""Bad markers: positions that a capture system wrote and where the marker was not.

====================  ==========================================================================
kind                  how it is detected
====================  ==========================================================================
zero                  a position of exactly (0, 0, 0): many systems write it for a lost marker
frozen                the very same position over frames in which the others move: a held value
swapped               two markers change places from one frame to the next, and would fit better
                      to the rest of the face where they were
spiked                a position off the line between the frames before and after, and as far off
                      where the rest of the face says that it should be
====================  ==========================================================================

A fast motion, of the lids say, leaves the line too, but the markers around it predict it; an odd
pose surprises these, but lasts. A spike does both.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, fields, replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, frozen
from facert.data.take import Source, Take
from facert.data.text import plural
from facert.models.gaussian import Gaussian
from facert.preprocess.cache import keep_last
from facert.preprocess.motion.series import interpolated

log = logging.getLogger(__name__)

HELD = 5
"""Live, a marker is held that repeats its position so often while most others move; rounded
positions repeat now and then as well."""
UNLIKELY = 1e-5
"""A run of repeats whose chance is less than this is a held value."""
ORDINARY, FAR = 0.9, 3.0
"""A spike lies so many times farther off than this share of all positions do."""
SLOW = 0.1
"""This share of a marker's steps are so small that it may have been at rest before."""
ROUNDED = 3.0
"""Rounding makes steps of this many times the smallest one."""
SMALL = 0.05
"""Spikes of less than this share of the largest standard deviation of a coordinate are let pass."""
FEWEST = 4
"""With fewer markers the rest of the face predicts too little to find a spike by."""
ROUNDS = 3
"""Large spikes widen the distribution that small ones are judged by: look again without them."""
DISTANCES_AT_ONCE = 4_000_000
FIT = 500
"""Frames that the distribution is fitted to, at most."""


@dataclass(frozen=True, eq=False)
class Faults:
    """Bad markers of a source by kind, each (T, M)."""

    zero: BoolArray
    frozen: BoolArray
    swapped: BoolArray
    spiked: BoolArray

    def __post_init__(self) -> None:
        for kind in fields(self):
            frozen(getattr(self, kind.name))  # cached: what one caller changed would stay

    @property
    def any(self) -> BoolArray:
        """Bad markers of any kind, (T, M)."""
        return np.asarray(self.zero | self.frozen | self.swapped | self.spiked)

    def __str__(self) -> str:
        """Counts by kind, e.g. ``"12 frozen, 3 spikes"``; ``"none"``."""
        counts = [(int(getattr(self, kind.name).sum()), kind.name) for kind in fields(self)]
        texts = (
            plural(count, "spike") if kind == "spiked" else f"{count} {kind}"
            for count, kind in counts
            if count
        )
        return ", ".join(texts) or "none"

    def hidden_from(self, source: Source) -> Source:
        """The source with its bad markers set to NaN.

        Raises
        ------
        InputError
            When nothing is left.
        """
        if not self.any.any():
            return source
        mask = self.any[:, :, None] if source.kind == "markers" else self.any
        return Source(np.where(mask, np.nan, source.values), source.names)


@keep_last
def find_faults(source: Source) -> Faults:
    """Bad markers of a take.

    Parameters
    ----------
    source : Source
        With its head motion: a held value shows only before that is taken out. Weights, which do
        rest and do jump, have no faults.

    Returns
    -------
    Faults
        An entry that was not observed is no fault.
    """
    if source.kind != "markers":
        nothing = np.zeros(source.values.shape, dtype=np.bool_)
        return Faults(nothing, nothing, nothing, nothing)
    zero = np.asarray((source.values == 0.0).all(axis=2))
    seen = np.where(zero[:, :, None], np.nan, source.values)
    frozen = held_values(seen)
    seen[frozen] = np.nan
    swapped = exchanged(seen)
    seen[swapped] = np.nan
    return Faults(zero, frozen, swapped, single_spikes(seen))


def without_faults(take: Take) -> Take:
    """The take with its bad markers hidden; how many, by kind, goes to the log."""
    faults = find_faults(take.source)
    if not faults.any.any():
        return take
    log.info("bad markers, taken as not observed: %s", faults)
    return replace(take, source=faults.hidden_from(take.source))


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
    steps[1:] = np.abs(np.diff(markers, axis=0)).max(axis=2)
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
    expected = _predicted(np.where(suspect[:, :, None], np.nan, markers))
    swapped = np.zeros_like(suspect)
    for first, second, rare in pairs:
        here, there = markers[rare][:, [first, second]], expected[rare][:, [first, second]]
        as_it_is = np.linalg.norm(here - there, axis=2).sum(axis=1)
        changed = np.linalg.norm(here[:, ::-1] - there, axis=2).sum(axis=1)
        if np.median(changed) < np.median(as_it_is):
            swapped[rare, first] = swapped[rare, second] = True
    return swapped


def single_spikes(markers: FloatArray) -> BoolArray:
    """Mask of positions that neither frames nor markers around them predict, (T, M).

    Parameters
    ----------
    markers : array, shape (T, M, 3)
        NaN: not observed.
    """
    seen = ~np.isnan(markers[:, :, 0])
    spikes = np.zeros_like(seen)
    ever = seen.any(axis=0)
    if len(markers) < 3 or ever.sum() < FEWEST:
        return spikes
    for _ in range(ROUNDS):
        left = np.where(spikes[:, ever, None], np.nan, markers[:, ever])
        largest = float(np.nanstd(left, axis=0).max())
        if largest == 0.0:
            break
        in_time = _off_in_time(left)
        off = np.minimum(in_time, _off_in_space(left))
        counted = ~np.isnan(left[:, :, 0])
        far = FAR * float(np.quantile(off[counted], ORDINARY)) + SMALL * largest
        found = counted & (off > far) & _peaks(in_time)
        if not found.any():
            break
        spikes[:, ever] |= found
    return spikes


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


def _fitted(X: FloatArray) -> Gaussian:
    """Fit a Gaussian to some frames, evenly spread, or to all if a column would be lost."""
    some = X[np.linspace(0, len(X) - 1, min(FIT, len(X))).round().astype(np.int64)]
    return Gaussian.of(X if np.isnan(some).all(axis=0).any() else some)


def _predicted(markers: FloatArray) -> FloatArray:
    """The frames filled; a marker that was never seen stays NaN."""
    ever = ~np.isnan(markers[:, :, 0]).all(axis=0)
    X = markers[:, ever].reshape(len(markers), -1)
    result = markers.copy()
    result[:, ever] = _fitted(X).fill(X).reshape(len(markers), -1, 3)
    return result


def _off_in_time(markers: FloatArray) -> FloatArray:
    """Distance of each position to a line, or a cubic, through those around, (T, M)."""
    frames = len(markers)
    X = interpolated(markers.reshape(frames, -1), np.arange(frames, dtype=np.float64))
    x = _continued(X.reshape(markers.shape))
    beside, beyond = x[1:-3] + x[3:-1], x[:-4] + x[4:]
    here = x[2:-2]
    off = np.stack([here - beside / 2.0, here - (4.0 * beside - beyond) / 6.0])
    return np.asarray(np.linalg.norm(off, axis=3).min(axis=0))


def _continued(x: FloatArray) -> FloatArray:
    """Frames extended by two at each end, along straight lines."""
    start = [4.0 * x[1] - 3.0 * x[2], 3.0 * x[1] - 2.0 * x[2]]
    end = [3.0 * x[-2] - 2.0 * x[-3], 4.0 * x[-2] - 3.0 * x[-3]]
    return np.concatenate([np.stack(start), x, np.stack(end)])


def _peaks(off: FloatArray) -> BoolArray:
    """Entries farther off than those of the frames before and after: a spike draws these along."""
    padded = np.pad(off, ((1, 1), (0, 0)), constant_values=-np.inf)
    return np.asarray((off >= padded[:-2]) & (off >= padded[2:]))


def _off_in_space(markers: FloatArray) -> FloatArray:
    """Distance of each position to its prediction by the rest of its frame, (T, M)."""
    frames, count = markers.shape[:2]
    X = markers.reshape(frames, -1)
    gaussian = _fitted(X)
    P = gaussian.precision
    pull = ((gaussian.fill(X) - gaussian.mean) @ P).reshape(frames, count, 3)
    own = P.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
    off = np.einsum("mij,tmj->tmi", np.linalg.inv(own), pull)
    return np.asarray(np.linalg.norm(off, axis=2))


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


class FaultDetector:
    """Bad markers of a live stream, from the frames so far: zero and frozen ones.

    Parameters
    ----------
    markers : int
        Number of markers.
    """

    def __init__(self, markers: int) -> None:
        self._last = np.full((markers, 3), np.nan)
        self._none: BoolArray = np.zeros(markers, dtype=np.bool_)
        self._repeats: IntArray = np.zeros(markers, dtype=np.int64)

    def step(self, markers: FloatArray) -> BoolArray:
        """The bad markers (M,) of one more frame (M, 3); NaN: not observed."""
        repeated, last = markers == self._last, self._last
        self._last = np.where(np.isnan(markers), last, markers)
        if markers.all() and not repeated.any():  # as nearly always
            self._repeats = np.zeros_like(self._repeats)
            return self._none
        zero = (markers == 0.0).all(axis=1)
        same = repeated.all(axis=1)
        whole = same.sum() > np.count_nonzero(~np.isnan(markers[:, 0])) / 2
        # A whole frame that repeats was sent twice, or the face rests.
        self._repeats = np.where(same, self._repeats + (not whole), 0)
        return np.asarray(zero | (same & (self._repeats >= HELD)))
