"""Where the rest of a frame puts each marker, by a Gaussian of the take.

The covariance of all coordinates takes the square of their number in memory, and its inverse the
cube in time. Of many markers each is predicted by the few directions in which the whole face moves,
which are in proportion to the markers; one marker hardly counts in these.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, lengths
from facert.data.blocks import blocks, spread
from facert.data.normalisation import Normalisation
from facert.models.gaussian import Gaussian
from facert.preprocess.motion.motion_factors import MotionFactors, part_of, units_of
from facert.preprocess.motion.series import interpolated

FIT, FIT_MANY = 500, 200
"""Frames that the distribution is fitted to, at most; and that of many markers."""
TOGETHER = 128
"""Markers of which each is predicted by all others; of more, by leading directions."""
DIRECTIONS, ITERATIONS = 24, 4
"""So many, found in so many iterations."""
ALL = 1_000_000
"""Positions; where no more are in a take, all of it is looked at if some frames hide a marker."""
IN_MEMORY = 1 << 20
"""Numbers of the frames that are predicted together."""


class Expected(Protocol):
    """A distribution of the frames of a face."""

    def off(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        """Distance of each position to its prediction by what is not suspect, (T, M).

        Parameters
        ----------
        markers : array, shape (T, M, 3)
            NaN: not observed; the distance is 0.
        suspect : array of bool, shape (T, M)
        """
        ...

    def fill(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        """Frames (T, M, 3) with what is suspect (T, M) where the rest puts it."""
        ...


def expected_of(markers: FloatArray, noise: float = 0.0) -> Expected:
    """The distribution of frames (n, M, 3), NaN: not observed, but once each of few markers.

    `noise` is the standard deviation of what predicts nothing.
    """
    few = markers.shape[1] <= TOGETHER
    return _Joint.of(markers, noise) if few else _Directions.of(markers, noise)


def predicted(markers: FloatArray, suspect: BoolArray) -> FloatArray:
    """The frames with what is suspect (T, M) where the rest puts it; NaN where nothing was seen."""
    hidden = np.isnan(markers[:, :, 0]) | suspect
    ever = np.asarray(~hidden.all(axis=0))
    if not ever.all() and markers.shape[1] <= TOGETHER:
        result = np.where(hidden[:, :, None], np.nan, markers)
        result[:, ever] = predicted(markers[:, ever], suspect[:, ever])
        return result
    rows = some_frames(hidden)
    fitted = np.where(hidden[rows][:, :, None], np.nan, markers[rows])
    return expected_of(fitted).fill(markers, suspect)


def some_frames(hidden: BoolArray, most: int = FIT) -> IntArray:
    """Some frames, evenly spread, that show each marker where not all (T, M) hide it."""
    rows = spread(len(hidden), most if hidden.shape[1] <= TOGETHER else FIT_MANY)
    lost = np.flatnonzero(hidden[rows].all(axis=0) & ~hidden.all(axis=0))
    if len(lost) and hidden.size <= ALL:
        return np.arange(len(hidden))
    return np.union1d(rows, hidden[:, lost].argmin(axis=0)) if len(lost) else rows


@dataclass(frozen=True, eq=False)
class _Joint:
    """A Gaussian of all coordinates."""

    gaussian: Gaussian

    @classmethod
    def of(cls, markers: FloatArray, noise: float) -> _Joint:
        fitted = Gaussian.of(_flat(markers))
        if noise:
            wider = fitted.covariance + noise**2 * np.eye(len(fitted.mean))
            fitted = Gaussian(fitted.mean, wider)
        return cls(fitted)

    def fill(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        filled = np.empty(markers.shape)
        for rows in blocks(len(markers), 3 * markers.shape[1], IN_MEMORY):
            left = np.where(suspect[rows][:, :, None], np.nan, markers[rows])
            filled[rows] = self.gaussian.fill(_flat(left)).reshape(left.shape)
        return filled

    def off(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        result = np.empty(suspect.shape)
        for rows in blocks(len(markers), 3 * markers.shape[1], IN_MEMORY):
            result[rows] = self._off(markers[rows], suspect[rows])
        return result

    def _off(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        frames, count = suspect.shape
        filled = self.fill(markers, suspect)
        P = self.gaussian.precision
        pull = ((_flat(filled) - self.gaussian.mean) @ P).reshape(frames, count, 3)
        own = P.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
        away = np.matmul(pull.transpose(1, 0, 2), np.linalg.inv(own)).transpose(1, 0, 2)
        if suspect.any():
            away = np.where(suspect[:, :, None], markers - filled, away)
        return np.asarray(np.nan_to_num(np.linalg.norm(away, axis=2)))


@dataclass(frozen=True, eq=False)
class _Directions:
    """Leading directions, by which some markers predict all."""

    factors: MotionFactors  # Of the coordinates, in `units`
    units: Normalisation
    # The coordinates that they are found from; of those that were never seen the mean is NaN
    part: IntArray

    @classmethod
    def of(cls, markers: FloatArray, noise: float) -> _Directions:
        ever = np.repeat(~np.isnan(markers[:, :, 0]).all(axis=0), 3)
        X = _flat(markers)[:, ever]
        own = units_of(X)
        X, scale = own.apply(X), own.scale
        filled = interpolated(X[:, part_of(X.shape[1])], np.arange(len(X), dtype=np.float64))
        count = min(DIRECTIONS, len(X) - 1)
        found = MotionFactors.learned(X, filled, noise / scale, count, ITERATIONS)
        place = np.where(ever, np.cumsum(ever) - 1, 0)
        factors = found.with_noise((noise / scale) ** 2).at(place)
        units = Normalisation(np.where(ever, own.mean[place], np.nan), scale)
        return cls(factors, units, np.flatnonzero(ever)[part_of(X.shape[1])])

    def fill(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        filled, z = markers.copy(), self._factors_of(markers, suspect)
        for rows in blocks(len(markers), 3 * markers.shape[1], IN_MEMORY):
            if suspect[rows].any():
                there = suspect[rows]
                filled[rows][there] = self._placed(z[rows])[there]
        return filled

    def off(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        result, z = np.empty(suspect.shape), self._factors_of(markers, suspect)
        for rows in blocks(len(markers), 3 * markers.shape[1], IN_MEMORY):
            away = self._placed(z[rows])
            away -= markers[rows]
            result[rows] = lengths(away)
        return np.nan_to_num(result, copy=False)

    def _factors_of(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        """The factors of each frame (T, M, 3) by what is not suspect, (T, q)."""
        own = Normalisation(self.units.mean[self.part], self.units.scale)
        factors, z = self.factors.at(self.part), np.empty((len(markers), self.factors.count))
        for rows in blocks(len(markers), len(self.part), IN_MEMORY):
            known = _flat(markers[rows])[:, self.part]
            known[suspect[rows][:, self.part // 3]] = np.nan
            z[rows], _ = factors.posterior(own.apply(known))
        return z

    def _placed(self, z: FloatArray) -> FloatArray:
        """Where factors (T, q) put the markers, (T, M, 3)."""
        return self.units.undo(self.factors.frames(z)).reshape(len(z), -1, 3)


def _flat(markers: FloatArray) -> FloatArray:
    return markers.reshape(len(markers), -1)
