"""A take without noise and gaps, from itself alone.

Two layers, each smooth in time: the few factors that move the face, estimated over all frames
together from whatever each shows, and what of every column they leave over, which tells between
one sight of a marker and the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.cleaning.factors import Factors
from facert.cleaning.interpolation import interpolated
from facert.cleaning.matern import decay
from facert.cleaning.noise import capture_noise
from facert.cleaning.smoothing import Smoothed, smooth_factors, smooth_series
from facert.data import FloatArray
from facert.normalisation import Normalisation

FACTORS = 16
FIT = 1000
"""Frames that the factors are learned from, at most, evenly spread."""
LEAST_NOISE = 1e-4
"""Least standard deviation of the noise, normalised units: half a micrometre of skin."""
START = 0.95
"""Correlation of a factor in neighbouring frames, to begin with."""
STRETCH, STRETCHES, ROUNDS = 40, 25, 3
"""How quickly factors move is learned from so many stretches of so many frames, in rounds."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Frames as they were, as far as can be told.

    Parameters
    ----------
    frames, std : array, shape (T, d)
        Mean and standard deviation; NaN in columns that were never observed.
    sigma : float
        Standard deviation of the capture noise.
    """

    frames: FloatArray
    std: FloatArray
    sigma: float


def estimate(X: FloatArray, sigma: float | None = None) -> Estimate:
    """The joint estimate of all frames.

    Parameters
    ----------
    X : array, shape (T, d)
        Frames, evenly spaced in time; NaN: not observed.
    sigma : float, optional
        Standard deviation of the capture noise; from the frames by default.

    Raises
    ------
    InputError
        When nothing moves.
    """
    sigma = capture_noise(X) if sigma is None else sigma
    ever = ~np.isnan(X).all(axis=0)
    units = Normalisation.of(X[:, ever], "/source")
    mean, variance = _layers(units.apply(X[:, ever]), max(sigma / units.scale, LEAST_NOISE))
    frames, std = np.full(X.shape, np.nan), np.full(X.shape, np.nan)
    frames[:, ever], std[:, ever] = units.undo(mean), units.scale * np.sqrt(variance)
    return Estimate(frames, std, sigma)


def _layers(X: FloatArray, sigma: float) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of normalised frames (T, d), every column of which was seen."""
    seen = ~np.isnan(X)
    filled = interpolated(X, np.arange(len(X), dtype=np.float64))
    some = np.unique(np.linspace(0, len(X) - 1, min(FIT, len(X))).round().astype(np.int64))
    some = some if seen[some].any(axis=0).all() else np.arange(len(X))
    factors = Factors.learned(X[some], filled[some], sigma, min(FACTORS, len(some) - 1))
    factors, a = _paced(factors, X)
    found = smooth_factors(*factors.information(X), a)
    frames = factors.frames(found.mean)
    rest, rest_variance = _rest(np.where(seen, X - frames, np.nan), sigma)
    variance = factors.variance(found.covariance) + rest_variance
    # The layers take each other for noise: of what was seen, both know less than the sight told.
    return frames + rest, np.where(seen, np.minimum(variance, sigma**2), variance)


def _paced(factors: Factors, X: FloatArray) -> tuple[Factors, FloatArray]:
    """The factors in units of their deviation, and how quickly each moves."""
    length = min(STRETCH, len(X))
    starts = np.unique(np.linspace(0, len(X) - length, STRETCHES).round().astype(np.int64))
    windows = X[starts + np.arange(length)[:, None]]  # (length, stretches, d)
    q = factors.weights.shape[1]
    a = decay(np.full(q, START))
    if length < 2:
        return factors, a
    for _ in range(ROUNDS):
        precision, pull = factors.information(windows.reshape(-1, X.shape[1]))
        shape = windows.shape[:2]
        found = smooth_factors(precision.reshape(*shape, q, q), pull.reshape(*shape, q), a)
        square = _squares(found)
        a = decay(found.following.mean(axis=(0, 1)) / square)
        factors = factors.scaled(np.sqrt(square))
    return factors, a


def _squares(found: Smoothed) -> FloatArray:
    """Mean square of each factor, (q,)."""
    own = np.diagonal(found.covariance, axis1=-2, axis2=-1)
    return np.asarray((found.mean**2 + own).mean(axis=(0, 1)))


def _rest(left: FloatArray, sigma: float) -> tuple[FloatArray, FloatArray]:
    """Smooth what the factors leave over, each column on its own; NaN: not observed."""
    noise = sigma**2
    variance = np.maximum(np.nanmean(left**2, axis=0) - noise, noise * 1e-2)
    steps = np.diff(left, axis=0) ** 2
    known = ~np.isnan(steps).all(axis=0)
    rough = variance.copy()
    rough[known] = np.maximum(np.nanmean(steps[:, known], axis=0) / 2.0 - noise, 0.0)
    return smooth_series(left, ~np.isnan(left), variance, noise, decay(1.0 - rough / variance))
