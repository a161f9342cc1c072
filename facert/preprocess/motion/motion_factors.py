"""Few factors that move all columns of a take, learned through gaps.

A frame is x = μ + W z + e with q factors z ~ N(0, I) and noise e of its own variance in every
column: factor analysis, by expectation maximisation over what was observed (Rubin and Thayer 1982;
with gaps, each row of W is a regression on the frames that show its column). A covariance of all
columns, estimated through the same gaps, needs far more frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from facert.data.array_group import ArrayGroup
from facert.data.arrays import BoolArray, FloatArray

ITERATIONS = 16
COARSE, FINE = 0.1, 1e-3
"""Least standard deviation of the noise in the first and in the last iteration, normalised units.
Large motion is learned first: with little noise from the start, the search hardly moves on."""
MANY = 1500
"""Columns, beyond which the covariance of all is dear."""
ONCE_MORE = 1.0
"""The prior of each weight counts as much as so many frames of its factor."""


@dataclass(frozen=True, eq=False)
class MotionFactors(ArrayGroup):
    """A few factors that move all columns."""

    mean: Annotated[FloatArray, "x"]  # (d,): μ
    weights: Annotated[FloatArray, "xq"]  # (d, q): W
    noise: Annotated[FloatArray, "x"]  # (d,): Variance of e

    @classmethod
    def learned(cls, X: FloatArray, filled: FloatArray, sigma: float, count: int) -> MotionFactors:
        """The factors of frames with gaps.

        Parameters
        ----------
        X : array, shape (n, d)
            Normalised frames; NaN: not observed.
        filled : array, shape (n, d)
            The same with a first guess in the gaps.
        sigma : float
            Standard deviation of the capture noise.
        count : int
            q, at most.
        """
        schedule = np.geomspace(max(COARSE, sigma), max(FINE, sigma), ITERATIONS)
        factors = cls._principal(filled, count, schedule[0])
        seen = ~np.isnan(X)
        for least in schedule:
            z, covariance = factors.posterior(X)
            factors = _maximised(np.where(seen, X, 0.0), seen, z, covariance, least)
        return factors._turned()

    @classmethod
    def _principal(cls, X: FloatArray, count: int, least: float) -> MotionFactors:
        variances, axes = _principal_axes(X)
        count = min(count, len(variances))
        kept = np.maximum(variances[:count], np.finfo(float).eps)
        weights = axes[:, :count] * np.sqrt(kept)
        left = np.maximum(X.var(axis=0) - (weights**2).sum(axis=1), 0.0)
        return cls(X.mean(axis=0), weights, left + least**2)

    def information(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Precision (n, q, q) of each frame's factors by what it shows, and that times z, (n, q).

        Parameters
        ----------
        X : array, shape (n, d)
            NaN: not observed.
        """
        seen = ~np.isnan(X)
        weight = seen / self.noise
        q = self.count
        pull = (np.where(seen, X - self.mean, 0.0) * weight) @ self.weights
        return (weight @ self._squares).reshape(-1, q, q), pull

    def posterior(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean (n, q) and covariance (n, q, q) of each frame's factors, regardless of time."""
        precision, pull = self.information(X)
        covariance = np.linalg.inv(precision + np.eye(precision.shape[1]))
        return np.einsum("nkl,nl->nk", covariance, pull), np.asarray(covariance)

    def frames(self, z: FloatArray) -> FloatArray:
        """μ + W z for factors (n, q)."""
        return np.asarray(self.mean + z @ self.weights.T)

    def variance(self, covariance: FloatArray) -> FloatArray:
        """Variance of W z, (n, d), for covariances of the factors, (n, q, q)."""
        return np.asarray(covariance.reshape(len(covariance), -1) @ self._squares.T)

    @property
    def _squares(self) -> FloatArray:
        """Products of each column's weights with each other, (d, q²)."""
        W = self.weights
        return np.asarray((W[:, :, None] * W[:, None, :]).reshape(len(W), -1))

    @property
    def count(self) -> int:
        """Number of factors q."""
        return int(self.weights.shape[1])

    def with_noise(self, more: float, least: float = 0.0) -> MotionFactors:
        """The factors with `more` (or less) noise in every column, and at least `least`."""
        return MotionFactors(self.mean, self.weights, np.maximum(self.noise + more, least))

    def scaled(self, deviation: FloatArray) -> MotionFactors:
        """The factors in units of their standard deviation, (q,)."""
        return MotionFactors(self.mean, self.weights * deviation, self.noise)

    def _turned(self) -> MotionFactors:
        """The factors turned to be independent given a frame, the most certain first."""
        _, turn = np.linalg.eigh(self.weights.T @ (self.weights / self.noise[:, None]))
        return MotionFactors(self.mean, self.weights @ turn[:, ::-1], self.noise)


def _principal_axes(X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Variances, falling, and directions (d, r) of frames (n, d).

    Of many columns the covariance is not made: their frames span few directions.
    """
    if X.shape[1] > max(MANY, len(X)):
        _, spread, axes = np.linalg.svd(X - X.mean(axis=0), full_matrices=False)
        return spread**2 / len(X), axes.T
    covariance = np.cov(X, rowvar=False, bias=True).reshape(X.shape[1], X.shape[1])
    variances, axes = np.linalg.eigh(covariance)
    return variances[::-1], axes[:, ::-1]


def _maximised(
    X: FloatArray, seen: BoolArray, z: FloatArray, covariance: FloatArray, least: float
) -> MotionFactors:
    """Most likely mean, weights and noise given the factors' posterior; X is 0 where not seen."""
    n, q = z.shape
    moments = np.empty((n, q + 1, q + 1))
    moments[:, :q, :q] = covariance + z[:, :, None] * z[:, None, :]
    moments[:, q, :q] = moments[:, :q, q] = z
    moments[:, q, q] = 1.0
    sums = (seen.T.astype(np.float64) @ moments.reshape(n, -1)).reshape(-1, q + 1, q + 1)
    pull = X.T @ np.hstack([z, np.ones((n, 1))])
    prior = np.diag([*[ONCE_MORE] * q, 0.0])
    rows = np.linalg.solve(sums + prior, pull[:, :, None])[:, :, 0]
    left = (X**2).sum(axis=0) - 2.0 * (rows * pull).sum(axis=1)
    left += np.einsum("di,dij,dj->d", rows, sums, rows)
    noise = np.maximum(left / seen.sum(axis=0), least**2)
    root = np.linalg.cholesky(moments[:, :q, :q].mean(axis=0))  # z has unit covariance again
    weights = np.asarray(rows[:, :q] @ root, dtype=np.float64)
    return MotionFactors(rows[:, q].astype(np.float64), weights, noise)
