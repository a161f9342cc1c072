"""The motion of a source in time, to estimate its frames through noise and gaps.

Two layers, each smooth in time: the few factors that move the face, estimated over all frames
together from whatever each shows, and the rest that they leave of every column, which fills in
between two sights of a marker.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from facert.data.array_group import ArrayGroup
from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.blocks import blocks, spread
from facert.preprocess.motion.motion_factors import MotionFactors, part_of
from facert.preprocess.motion.series import interpolated
from facert.preprocess.motion.smoothing import (
    QUICKEST,
    Smoothed,
    decay,
    smooth_factors,
    smooth_series,
)

FACTORS = 16
FIT = 1000
"""Frames that the factors are learned from, at most, evenly spread."""
START = 0.95
"""Correlation of a factor in neighbouring frames, to begin with."""
STRETCH, STRETCHES, ROUNDS = 40, 25, 3
"""How quickly factors move is learned from so many stretches of so many frames, in rounds."""
SHOWN = 0.5
"""Stretches that show less than this share of what the best one shows are passed over."""
PART, OVERLAP = 5000, 500
"""Frames that are smoothed at once, and how many around them; the slowest motion is forgotten by
then."""
IN_MEMORY = 1 << 21
"""Numbers of the columns that are smoothed at once."""
LEAST_VARIANCE = 1e-6
"""Of what is peculiar to a column, normalised units."""


@dataclass(frozen=True, eq=False)
class Motion(ArrayGroup):
    """The motion of normalised frames, learned from a take."""

    # Of unit variance each; their noise is what else is in a column, without capture noise
    factors: MotionFactors
    # (q,): How quickly each factor moves, see `facert.preprocess.motion.smoothing`
    rates: Annotated[FloatArray, "q"]
    # (d,): Variance and rate of what the factors leave over of each column
    rest: Annotated[FloatArray, "x"]
    rest_rates: Annotated[FloatArray, "x"]
    # (2,): Seconds from frame to frame, which the rates are for, and the standard deviation of the
    # capture noise
    clock: Annotated[FloatArray, "2"]

    @property
    def sigma(self) -> float:
        """Standard deviation of the capture noise of the take it was learned from."""
        return float(self.clock[1])

    def every(self, seconds: float) -> Motion:
        """The motion of frames that come so many seconds apart."""
        ratio = seconds / self.clock[0]
        return replace(
            self,
            rates=np.minimum(self.rates * ratio, QUICKEST),
            rest_rates=np.minimum(self.rest_rates * ratio, QUICKEST),
            clock=np.array([seconds, self.sigma]),
        )

    @classmethod
    def learned(cls, X: FloatArray, sigma: float, seconds: float = 1.0) -> Motion:
        """The motion of a take.

        Parameters
        ----------
        X : array, shape (T, d)
            Normalised frames, evenly spaced in time; NaN: not observed. Every column was seen.
        sigma : float
            Standard deviation of the capture noise.
        seconds : float
            From frame to frame.
        """
        return cls.learned_over([X], sigma, [seconds])

    @classmethod
    def learned_over(
        cls, takes: Sequence[FloatArray], sigma: float, seconds: Sequence[float]
    ) -> Motion:
        """The motion of several takes, each with its own seconds from frame to frame.

        No stretch that it is learned from crosses from one take to the next. The rates are for the
        frames of the first take.
        """
        shown = [(~np.isnan(take)).mean(axis=1) for take in takes]
        rows = _rows(takes, shown)
        part = part_of(takes[0].shape[1])
        filled = _at([_filled(take[:, part]) for take in takes], rows)
        q = min(FACTORS, len(filled) - 1)
        factors = MotionFactors.learned(_at(takes, rows), filled, sigma, q)
        clocks = np.array(seconds) / seconds[0]
        stretches = _stretches(takes, shown, clocks)
        factors, rates = _paced(factors, stretches)
        rest = _rest(_residuals(factors, rates, stretches), _clocks(stretches), sigma)
        own, clock = factors.with_noise(-(sigma**2), LEAST_VARIANCE), np.array([seconds[0], sigma])
        return cls(own, rates, *rest, clock)

    def seen_with(self, sigma: float) -> MotionFactors:
        """The factors as a capture with noise of this standard deviation shows them."""
        return self.factors.with_noise(sigma**2)

    def smooth(self, X: FloatArray, sigma: float) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (T, d) of each frame given all of them; see `learned`.

        Long takes are done in parts that overlap, so that memory stays bounded.
        """
        factors = self.seen_with(sigma)
        mean, variance = np.empty_like(X), np.empty_like(X)
        for start in range(0, len(X), PART):
            first = max(start - OVERLAP, 0)
            part, kept = X[first : start + PART + OVERLAP], slice(start, start + PART)
            inner = slice(start - first, start - first + PART)
            found = smooth_factors(*factors.information(part), self.rates)
            for columns in blocks(X.shape[1], len(part), IN_MEMORY):
                own = self._smooth(part[:, columns], found, columns, sigma)
                mean[kept, columns], variance[kept, columns] = (one[inner] for one in own)
        return mean, variance

    def _smooth(
        self, X: FloatArray, found: Smoothed, columns: slice, sigma: float
    ) -> tuple[FloatArray, FloatArray]:
        """Mean and variance of some columns of frames (T, d) of which the factors are found."""
        seen, factors = ~np.isnan(X), self.factors.at(columns)
        frames = factors.frames(found.mean)
        variance, rate = self.rest[columns], self.rest_rates[columns]
        rest, left = smooth_series(X - frames, seen, variance, sigma**2, rate)
        left += factors.variance(found.covariance)
        # The layers take each other for noise: both know less of what was seen than it showed.
        return frames + rest, np.where(seen, np.minimum(left, sigma**2), left)


def _rows(takes: Sequence[FloatArray], shown: Sequence[FloatArray]) -> list[IntArray]:
    """The frames of each take that factors are learned from: some that show anything.

    All of a short take, if a column would be lost; of a long one, besides, the first that show it.
    """
    for most in (FIT, PART):
        rows = _evenly([np.flatnonzero(one) for one in shown], most)
        lost = _lost(takes, rows)
        if not lost.any():
            break
    else:
        for k, take in enumerate(takes):
            known = ~np.isnan(take[:, lost])
            rows[k] = np.union1d(rows[k], known.argmax(axis=0)[known.any(axis=0)])
    return rows


def _lost(takes: Sequence[FloatArray], rows: Sequence[IntArray]) -> BoolArray:
    """Mask of the columns that none of these rows of the takes shows, (d,)."""
    lost = np.ones(takes[0].shape[1], dtype=np.bool_)
    for take, own in zip(takes, rows, strict=True):
        for row in own:
            if not lost.any():
                break
            lost &= np.isnan(take[row])
    return lost


def _at(takes: Sequence[FloatArray], rows: Sequence[IntArray]) -> FloatArray:
    """These rows of each take, one take after the other."""
    return np.concatenate([take[own] for take, own in zip(takes, rows, strict=True)])


def _evenly(indices: Sequence[IntArray], most: int) -> list[IntArray]:
    """At most so many of the indices of some takes, evenly spread over all."""
    ends = np.cumsum([0, *map(len, indices)])
    chosen = spread(int(ends[-1]), most)
    return [
        own[chosen[(chosen >= start) & (chosen < end)] - start]
        for own, start, end in zip(indices, ends[:-1], ends[1:], strict=True)
    ]


def _filled(X: FloatArray) -> FloatArray:
    """A take with its gaps filled along straight lines; what it never shows, by the mean, 0."""
    seen = ~np.isnan(X).all(axis=0)
    filled = np.zeros_like(X)
    filled[:, seen] = interpolated(X[:, seen], np.arange(len(X), dtype=np.float64))
    return filled


class _Stretches(NamedTuple):
    """Stretches of one take."""

    take: FloatArray  # (T, d)
    rows: IntArray  # (length, n)
    clock: float  # Time from frame to frame, relative

    def at(self, columns: slice | IntArray) -> FloatArray:
        """Some columns of them, (length, n, d')."""
        if isinstance(columns, slice):
            return self.take[:, columns][self.rows]
        return self.take[self.rows[:, :, None], columns]


def _stretches(
    takes: Sequence[FloatArray], shown: Sequence[FloatArray], clocks: FloatArray
) -> list[_Stretches]:
    """`STRETCHES` of all takes, evenly spread over those that show enough."""
    length = min(STRETCH, max(map(len, takes)))
    long = [k for k, take in enumerate(takes) if len(take) >= length]
    means = [sliding_window_view(shown[k], length).mean(axis=1) for k in long]
    enough = SHOWN * max(one.max() for one in means)
    starts = _evenly([np.flatnonzero(one >= enough) for one in means], STRETCHES)
    return [
        _Stretches(takes[k], own + np.arange(length)[:, None], float(clocks[k]))
        for k, own in zip(long, starts, strict=True)
        if len(own)
    ]


def _paced(
    factors: MotionFactors, stretches: Sequence[_Stretches]
) -> tuple[MotionFactors, FloatArray]:
    """Factors in units of their deviation, and the rate of each, by what some columns show."""
    rates = decay(np.full(factors.count, START))
    for _ in range(ROUNDS):
        found = [_smoothed(factors, one, rates) for one in stretches]
        squares = np.stack([_squares(one) for one in found])
        counts = np.array([one.mean.shape[1] for one in found], dtype=np.float64)
        following = np.stack([one.following.mean(axis=(0, 1)) for one in found])
        weights = (counts / counts.sum())[:, None] * squares
        rates = _mean_rate(decay(following / squares), _clocks(stretches), weights)
        factors = factors.scaled(np.sqrt(weights.sum(axis=0)))
    return factors, rates


def _clocks(stretches: Sequence[_Stretches]) -> FloatArray:
    return np.array([one.clock for one in stretches])


def _mean_rate(rates: FloatArray, clocks: FloatArray, weights: FloatArray) -> FloatArray:
    """Rates for frames of the first take, (q,), from those of each take's frames, by weights."""
    total = weights.sum(axis=0)
    even = np.full_like(weights, 1.0 / len(weights))
    shares = np.divide(weights, total, out=even, where=total > 0.0)
    return np.asarray((shares * (rates / clocks[:, None])).sum(axis=0))


def _smoothed(factors: MotionFactors, stretches: _Stretches, rates: FloatArray) -> Smoothed:
    """The factors of stretches, each on its own, by what some columns show."""
    part = part_of(len(factors.mean))
    windows, q = stretches.at(part), factors.count
    shape = windows.shape[:2]
    precision, pull = factors.at(part).information(windows.reshape(-1, len(part)))
    own = np.minimum(rates * stretches.clock, QUICKEST)
    return smooth_factors(precision.reshape(*shape, q, q), pull.reshape(*shape, q), own)


def _squares(found: Smoothed) -> FloatArray:
    """Mean square of each factor, (q,)."""
    own = np.diagonal(found.covariance, axis1=-2, axis2=-1)
    return np.asarray((found.mean**2 + own).mean(axis=(0, 1)))


class _Residuals(NamedTuple):
    """What the factors leave of stretches, summed up."""

    square: FloatArray  # (d,): Mean square; NaN where nothing was observed
    # (takes, d): Mean square of the steps from frame to frame in each take, and their number
    steps: FloatArray
    counts: FloatArray

    @classmethod
    def of(cls, left: Sequence[FloatArray]) -> _Residuals:
        """Of the residuals (length, n, d) of each take."""
        steps = [np.diff(one, axis=0) for one in left]
        counts = [(~np.isnan(own)).sum(axis=(0, 1), dtype=np.float64) for own in steps]
        each = np.stack([_mean_square([own]) for own in steps])
        return cls(_mean_square(left), each, np.stack(counts))


def _residuals(
    factors: MotionFactors, rates: FloatArray, stretches: Sequence[_Stretches]
) -> _Residuals:
    found = [_smoothed(factors, one, rates).mean for one in stretches]
    parts = []
    for columns in blocks(len(factors.mean), sum(one.rows.size for one in stretches)):
        own = factors.at(columns)
        left = [one.at(columns) - own.frames(z) for one, z in zip(stretches, found, strict=True)]
        parts.append(_Residuals.of(left))
    return _Residuals(*(np.concatenate(one, axis=-1) for one in zip(*parts, strict=True)))


def _rest(left: _Residuals, clocks: FloatArray, sigma: float) -> tuple[FloatArray, FloatArray]:
    """Variance and rate of the residual of the factors, from stretches.

    A column that no stretch shows is taken to be like the others.
    """
    variance = left.square - sigma**2
    variance = np.maximum(np.where(np.isnan(variance), np.nanmedian(variance), variance), 0.0)
    variance = np.maximum(variance, max(sigma**2 * 1e-2, LEAST_VARIANCE))
    rough = np.maximum(left.steps / 2.0 - sigma**2, 0.0)
    rates = decay(1.0 - np.where(np.isnan(rough), variance, rough) / variance)
    return variance, _mean_rate(rates, clocks, left.counts)


def _mean_square(parts: Sequence[FloatArray]) -> FloatArray:
    """Mean square of each column of arrays (..., d), (d,); NaN where all is NaN."""
    known = [~np.isnan(part) for part in parts]
    count = np.asarray(sum(one.sum(axis=(0, 1)) for one in known))
    squares = (np.where(one, part, 0.0) ** 2 for one, part in zip(known, parts, strict=True))
    total = np.asarray(sum(one.sum(axis=(0, 1)) for one in squares))
    return np.asarray(np.where(count, total, np.nan) / np.maximum(count, 1))
