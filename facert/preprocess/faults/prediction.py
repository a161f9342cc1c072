"""Where the rest of a frame puts each marker, by a Gaussian of the take.

The covariance of all coordinates takes the square of their number in memory, and its inverse the
cube in time. Of many markers each is predicted by those that lie around it: the Gaussian is one
each of parts of the face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.models.gaussian import Gaussian
from facert.preprocess.faults.quantiles import median

FIT = 500
"""Frames that the distribution is fitted to, at most."""
TOGETHER, PART = 128, 64
"""Markers that predict each other, at most; of more, parts of at most so many."""


def spread_rows(frames: int, most: int = FIT) -> IntArray:
    """The indices of some frames, evenly spread, or of all."""
    return np.linspace(0, frames - 1, min(most, frames)).round().astype(np.int64)


def parts_of(markers: FloatArray) -> list[IntArray]:
    """The parts of a face (T, M, 3) by their markers; the whole face where these are few.

    A part is cut in two across its longest side until it is small enough.
    """
    if markers.shape[1] <= TOGETHER:
        return [np.arange(markers.shape[1])]
    places = np.nan_to_num(median(markers[spread_rows(len(markers))].transpose(1, 2, 0)))
    parts, done = [np.arange(len(places))], []
    while parts:
        part = parts.pop()
        if len(part) <= PART:
            done.append(part)
            continue
        along = np.argsort(places[part][:, np.ptp(places[part], axis=0).argmax()], kind="stable")
        parts += np.array_split(part[along], 2)
    return [np.sort(part) for part in done]


@dataclass(frozen=True, eq=False)
class Expected:
    """A Gaussian of the frames of each part of a face, independent of the others."""

    parts: Sequence[tuple[IntArray, Gaussian]]

    @classmethod
    def of(cls, markers: FloatArray, parts: Sequence[IntArray], noise: float = 0.0) -> Expected:
        """Fit to frames (n, M, 3), NaN: not observed, but once each marker.

        `noise` is the standard deviation of what predicts nothing.
        """
        return cls([(part, _with_noise(_fitted(markers[:, part]), noise)) for part in parts])

    def fill(self, markers: FloatArray) -> FloatArray:
        """Frames (T, M, 3) with what was not observed where the rest puts it."""
        filled = markers.copy()
        for part, gaussian in self.parts:
            known = markers[:, part]
            filled[:, part] = gaussian.fill(_flat(known)).reshape(known.shape)
        return filled

    def off(self, markers: FloatArray, suspect: BoolArray) -> FloatArray:
        """Distance of each position to its prediction by what is not suspect in its part, (T, M).

        Parameters
        ----------
        markers : array, shape (T, M, 3)
            NaN: not observed; the distance is 0.
        suspect : array of bool, shape (T, M)
        """
        result = np.zeros(suspect.shape)
        for part, gaussian in self.parts:
            result[:, part] = _off(gaussian, markers[:, part], suspect[:, part])
        return result


def predicted(markers: FloatArray, suspect: BoolArray) -> FloatArray:
    """The frames with what is suspect (T, M) where the rest puts it; NaN where nothing was seen.

    Parts without a suspect stay as they are.
    """
    left = np.where(suspect[:, :, None], np.nan, markers)
    ever = ~np.isnan(left[:, :, 0]).all(axis=0)
    known, doubted = left[:, ever], np.asarray(suspect[:, ever].any(axis=0))
    parts = [part for part in parts_of(known) if doubted[part].any()]
    left[:, ever] = Expected.of(_some(known), parts).fill(known)
    return left


def off_in_space(markers: FloatArray) -> FloatArray:
    """Distance of each position to its prediction by the rest of its part, (T, M)."""
    expected = Expected.of(_some(markers), parts_of(markers))
    return expected.off(markers, np.zeros(markers.shape[:2], dtype=np.bool_))


def _some(markers: FloatArray) -> FloatArray:
    """Some frames, evenly spread, or all if a marker would be lost."""
    some = markers[spread_rows(len(markers))]
    return markers if np.isnan(some).all(axis=0).any() else some


def _fitted(markers: FloatArray) -> Gaussian:
    return Gaussian.of(_flat(markers))


def _with_noise(gaussian: Gaussian, noise: float) -> Gaussian:
    if not noise:
        return gaussian
    return Gaussian(gaussian.mean, gaussian.covariance + noise**2 * np.eye(len(gaussian.mean)))


def _flat(markers: FloatArray) -> FloatArray:
    return markers.reshape(len(markers), -1)


def _off(gaussian: Gaussian, markers: FloatArray, suspect: BoolArray) -> FloatArray:
    frames, count = suspect.shape
    filled = gaussian.fill(_flat(np.where(suspect[:, :, None], np.nan, markers)))
    P = gaussian.precision
    pull = ((filled - gaussian.mean) @ P).reshape(frames, count, 3)
    own = P.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
    away = np.matmul(pull.transpose(1, 0, 2), np.linalg.inv(own)).transpose(1, 0, 2)
    if suspect.any():
        away = np.where(suspect[:, :, None], markers - filled.reshape(markers.shape), away)
    return np.asarray(np.nan_to_num(np.linalg.norm(away, axis=2)))
