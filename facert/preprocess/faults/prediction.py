"""Where the rest of a frame puts each marker, by a Gaussian of the take."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.models.gaussian import Gaussian

FIT = 500
"""Frames that the distribution is fitted to, at most."""


def spread_rows(frames: int, most: int = FIT) -> IntArray:
    """The indices of some frames, evenly spread, or of all."""
    return np.linspace(0, frames - 1, min(most, frames)).round().astype(np.int64)


def fitted(X: FloatArray) -> Gaussian:
    """Fit a Gaussian to some frames, evenly spread, or to all if a column would be lost."""
    some = X[spread_rows(len(X))]
    return Gaussian.of(X if np.isnan(some).all(axis=0).any() else some)


def predicted(markers: FloatArray) -> FloatArray:
    """The frames filled; a marker that was never seen stays NaN."""
    ever = ~np.isnan(markers[:, :, 0]).all(axis=0)
    X = markers[:, ever].reshape(len(markers), -1)
    result = markers.copy()
    result[:, ever] = fitted(X).fill(X).reshape(len(markers), -1, 3)
    return result


def off_in_space(markers: FloatArray) -> FloatArray:
    """Distance of each position to its prediction by the rest of its frame, (T, M)."""
    filled = fitted(markers.reshape(len(markers), -1))
    return off(filled, markers, np.zeros(markers.shape[:2], dtype=np.bool_))


def off(gaussian: Gaussian, markers: FloatArray, suspect: BoolArray) -> FloatArray:
    """Distance of each position to its prediction by what is not suspect in its frame, (T, M).

    Parameters
    ----------
    gaussian : Gaussian
        Of the frames, (3 M,).
    markers : array, shape (T, M, 3)
        NaN: not observed; the distance is 0.
    suspect : array of bool, shape (T, M)
    """
    frames, count = suspect.shape
    X = np.where(suspect[:, :, None], np.nan, markers).reshape(frames, -1)
    filled, P = gaussian.fill(X), gaussian.precision
    pull = ((filled - gaussian.mean) @ P).reshape(frames, count, 3)
    own = P.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
    away = np.matmul(pull.transpose(1, 0, 2), np.linalg.inv(own)).transpose(1, 0, 2)
    if suspect.any():
        away = np.where(suspect[:, :, None], markers - filled.reshape(markers.shape), away)
    return np.asarray(np.nan_to_num(np.linalg.norm(away, axis=2)))
