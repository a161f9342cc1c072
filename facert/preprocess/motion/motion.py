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

from facert.data.array_group import ArrayGroup
from facert.data.arrays import FloatArray, IntArray
from facert.preprocess.motion.motion_factors import MotionFactors
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
        X = np.concatenate(takes)
        seen = ~np.isnan(X)
        some = _spread(np.flatnonzero(seen.any(axis=1)), FIT)
        some = some if seen[some].any(axis=0).all() else np.arange(len(X))
        filled = np.concatenate([_filled(take) for take in takes])
        factors = MotionFactors.learned(X[some], filled[some], sigma, min(FACTORS, len(some) - 1))
        clocks = np.array(seconds) / seconds[0]
        factors, rates, left = _paced(factors, _stretches(takes, clocks))
        own, clock = factors.with_noise(-(sigma**2), LEAST_VARIANCE), np.array([seconds[0], sigma])
        return cls(own, rates, *_rest(left, sigma), clock)

    def seen_with(self, sigma: float) -> MotionFactors:
        """The factors as a capture with noise of this standard deviation shows them."""
        return self.factors.with_noise(sigma**2)

    def smooth(self, X: FloatArray, sigma: float) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (T, d) of each frame given all of them; see `learned`.

        Long takes are done in parts that overlap, so that memory stays bounded.
        """
        parts = []
        for start in range(0, len(X), PART):
            first = max(start - OVERLAP, 0)
            part = self._smooth(X[first : start + PART + OVERLAP], sigma)
            parts.append([values[start - first :][:PART] for values in part])
        mean, variance = (np.concatenate(values) for values in zip(*parts, strict=True))
        return mean, variance

    def _smooth(self, X: FloatArray, sigma: float) -> tuple[FloatArray, FloatArray]:
        seen = ~np.isnan(X)
        factors = self.seen_with(sigma)
        found = smooth_factors(*factors.information(X), self.rates)
        frames = factors.frames(found.mean)
        left = np.where(seen, X - frames, np.nan)
        rest, input_variance = smooth_series(left, seen, self.rest, sigma**2, self.rest_rates)
        variance = factors.variance(found.covariance) + input_variance
        # The layers take each other for noise: both know less of what was seen than it showed.
        return frames + rest, np.where(seen, np.minimum(variance, sigma**2), variance)


def _spread(indices: IntArray, most: int) -> IntArray:
    """At most so many of the frames, evenly spread."""
    count = len(indices)
    return indices[np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(np.int64))]


def _filled(X: FloatArray) -> FloatArray:
    """A take with its gaps filled along straight lines; what it never shows, by the mean, 0."""
    seen = ~np.isnan(X).all(axis=0)
    filled = np.zeros_like(X)
    filled[:, seen] = interpolated(X[:, seen], np.arange(len(X), dtype=np.float64))
    return filled


class _Stretches(NamedTuple):
    """Stretches of one take, (length, n, d), and its time from frame to frame, relative."""

    frames: FloatArray
    clock: float


def _stretches(takes: Sequence[FloatArray], clocks: FloatArray) -> list[_Stretches]:
    """`STRETCHES` of all takes, evenly spread over those that show enough."""
    length = min(STRETCH, max(map(len, takes)))
    parts = [
        (take, clock) for take, clock in zip(takes, clocks, strict=True) if len(take) >= length
    ]
    shown = [
        np.lib.stride_tricks.sliding_window_view((~np.isnan(take)).mean(axis=1), length).mean(
            axis=1
        )
        for take, _ in parts
    ]
    ends = np.cumsum([0, *map(len, shown)])
    of_all = np.concatenate(shown)
    chosen = _spread(np.flatnonzero(of_all >= SHOWN * of_all.max()), STRETCHES)
    found = []
    for (take, clock), start, end in zip(parts, ends[:-1], ends[1:], strict=True):
        own = chosen[(chosen >= start) & (chosen < end)] - start
        if len(own):
            found.append(_Stretches(take[own + np.arange(length)[:, None]], float(clock)))
    return found


def _paced(
    factors: MotionFactors, stretches: Sequence[_Stretches]
) -> tuple[MotionFactors, FloatArray, list[_Stretches]]:
    """Factors in units of their deviation, the rate of each, and the residuals of stretches."""
    rates = decay(np.full(factors.count, START))
    for _ in range(ROUNDS):
        found = [_smoothed(factors, one, rates) for one in stretches]
        squares = np.stack([_squares(one) for one in found])
        counts = np.array([one.mean.shape[1] for one in found], dtype=np.float64)
        following = np.stack([one.following.mean(axis=(0, 1)) for one in found])
        weights = (counts / counts.sum())[:, None] * squares
        rates = _mean_rate(decay(following / squares), stretches, weights)
        total = weights.sum(axis=0)
        factors = factors.scaled(np.sqrt(total))
    left = [
        one._replace(frames=one.frames - factors.frames(_smoothed(factors, one, rates).mean))
        for one in stretches
    ]
    return factors, rates, left


def _mean_rate(
    rates: FloatArray, stretches: Sequence[_Stretches], weights: FloatArray
) -> FloatArray:
    """Rates for frames of the first take, (q,), from those of each take's frames, by weights."""
    total = weights.sum(axis=0)
    even = np.full_like(weights, 1.0 / len(weights))
    shares = np.divide(weights, total, out=even, where=total > 0.0)
    clocks = np.array([one.clock for one in stretches])
    return np.asarray((shares * (rates / clocks[:, None])).sum(axis=0))


def _smoothed(factors: MotionFactors, stretches: _Stretches, rates: FloatArray) -> Smoothed:
    """The factors of stretches, each on its own."""
    windows, q = stretches.frames, factors.count
    shape = windows.shape[:2]
    precision, pull = factors.information(windows.reshape(-1, windows.shape[2]))
    own = np.minimum(rates * stretches.clock, QUICKEST)
    return smooth_factors(precision.reshape(*shape, q, q), pull.reshape(*shape, q), own)


def _squares(found: Smoothed) -> FloatArray:
    """Mean square of each factor, (q,)."""
    own = np.diagonal(found.covariance, axis1=-2, axis2=-1)
    return np.asarray((found.mean**2 + own).mean(axis=(0, 1)))


def _rest(left: Sequence[_Stretches], sigma: float) -> tuple[FloatArray, FloatArray]:
    """Variance and rate of the residual of the factors, from stretches.

    A column that no stretch shows is taken to be like the others.
    """
    variance = _mean_square([one.frames for one in left]) - sigma**2
    variance = np.maximum(np.where(np.isnan(variance), np.nanmedian(variance), variance), 0.0)
    variance = np.maximum(variance, max(sigma**2 * 1e-2, LEAST_VARIANCE))
    steps = [np.diff(one.frames, axis=0) for one in left]
    rough = [np.maximum(_mean_square([own]) / 2.0 - sigma**2, 0.0) for own in steps]
    rates = [decay(1.0 - np.where(np.isnan(own), variance, own) / variance) for own in rough]
    counts = [(~np.isnan(own)).sum(axis=(0, 1), dtype=np.float64) for own in steps]
    return variance, _mean_rate(np.stack(rates), left, np.stack(counts))


def _mean_square(parts: Sequence[FloatArray]) -> FloatArray:
    """Mean square of each column of arrays (..., d), (d,); NaN where all is NaN."""
    known = [~np.isnan(part) for part in parts]
    count = np.asarray(sum(one.sum(axis=(0, 1)) for one in known))
    squares = (np.where(one, part, 0.0) ** 2 for one, part in zip(known, parts, strict=True))
    total = np.asarray(sum(one.sum(axis=(0, 1)) for one in squares))
    return np.asarray(np.where(count, total, np.nan) / np.maximum(count, 1))
