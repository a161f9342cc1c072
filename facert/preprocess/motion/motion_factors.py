"""Few factors that move all columns of a take, learned through gaps.

A frame is x = μ + W z + e with q factors z ~ N(0, I) and noise e of its own variance in every
column: factor analysis, by expectation maximisation over what was observed (Rubin and Thayer 1982;
with gaps, each row of W is a regression on the frames that show its column). A covariance of all
columns, estimated through the same gaps, needs far more frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from facert.data.array_group import ArrayGroup
from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.blocks import blocks, spread
from facert.data.normalisation import Normalisation, deviation

ITERATIONS = 16
COARSE, FINE = 0.1, 1e-3
"""Least standard deviation of the noise in the first and in the last iteration, normalised units.
Large motion is learned first: with little noise from the start, the search hardly moves on."""
PART = 600
"""Of more columns the factors are learned from so many, evenly spread, which show all that moves
many; the weights of the others follow in the last iteration."""
IN_A_PRODUCT = 1 << 21
"""Numbers of the frames that are looked at together."""
FEW = 16
"""Where a matrix hides less than one of so many entries, these alone are summed."""
FILLING = 24
"""Factors that gaps of very many columns are filled by."""
ONCE_MORE = 1.0
"""The prior of each weight counts as much as so many frames of its factor."""


@dataclass(frozen=True, eq=False)
class MotionFactors(ArrayGroup):
    """A few factors that move all columns."""

    mean: Annotated[FloatArray, "x"]  # (d,): μ
    weights: Annotated[FloatArray, "xq"]  # (d, q): W
    noise: Annotated[FloatArray, "x"]  # (d,): Variance of e

    @classmethod
    def learned(
        cls,
        X: FloatArray,
        filled: FloatArray,
        sigma: float,
        count: int,
        iterations: int = ITERATIONS,
    ) -> MotionFactors:
        """The factors of frames with gaps.

        Parameters
        ----------
        X : array, shape (n, d)
            Normalised frames; NaN: not observed.
        filled : array, shape (n, p)
            The columns that `part_of` names, with a first guess in the gaps.
        sigma : float
            Standard deviation of the capture noise.
        count : int
            q, at most.
        iterations : int
            Of the search; the least noise falls from the first to the last of them.
        """
        schedule = np.geomspace(max(COARSE, sigma), max(FINE, sigma), iterations)
        factors = cls._principal(filled, count, schedule[0])
        some = _Shown.by(X[:, part_of(X.shape[1])])
        for least in schedule[:-1]:
            factors = _maximised(some, *factors._posterior(some), least)
        factors = _maximised(_Shown.by(X), *factors._posterior(some), schedule[-1])
        return factors._turned()

    @classmethod
    def _principal(cls, X: FloatArray, count: int, least: float) -> MotionFactors:
        covariance = np.cov(X, rowvar=False, bias=True).reshape(X.shape[1], X.shape[1])
        variances, axes = np.linalg.eigh(covariance)  # rising
        count = min(count, len(variances))
        kept = np.maximum(variances[::-1][:count], np.finfo(float).eps)
        weights = axes[:, ::-1][:, :count] * np.sqrt(kept)
        left = np.maximum(X.var(axis=0) - (weights**2).sum(axis=1), 0.0)
        return cls(X.mean(axis=0), weights, left + least**2)

    def information(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Precision (n, q, q) of each frame's factors by what it shows, and that times z, (n, q).

        Parameters
        ----------
        X : array, shape (n, d)
            NaN: not observed.
        """
        parts = [
            self._information(_Shown.by(X[rows]))
            for rows in blocks(len(X), X.shape[1], IN_A_PRODUCT)
        ]
        precision, pull = (np.concatenate(one) for one in zip(*parts, strict=True))
        return precision, pull

    def _information(self, shown: _Shown) -> tuple[FloatArray, FloatArray]:
        weighted, q = self.weights / self.noise[:, None], self.count
        products = np.hstack([_products(self.weights, weighted), self.mean[:, None] * weighted])
        sums = shown.sums(products)
        return _symmetric(sums[:, :-q], q), shown.known @ weighted - sums[:, -q:]

    def posterior(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean (n, q) and covariance (n, q, q) of each frame's factors, regardless of time."""
        return self._posterior(_Shown.by(X))

    def _posterior(self, shown: _Shown) -> tuple[FloatArray, FloatArray]:
        precision, pull = self._information(shown)
        covariance = np.linalg.inv(precision + np.eye(precision.shape[1]))
        return np.einsum("nkl,nl->nk", covariance, pull), np.asarray(covariance)

    def frames(self, z: FloatArray) -> FloatArray:
        """μ + W z for factors (n, q)."""
        return np.asarray(self.mean + z @ self.weights.T)

    def variance(self, covariance: FloatArray) -> FloatArray:
        """Variance of W z, (n, d), for covariances of the factors, (n, q, q)."""
        new = np.ones(len(covariance), dtype=np.bool_)
        new[1:] = (covariance[1:] != covariance[:-1]).any(axis=(1, 2))
        one, other = _pairs(self.count)
        twice = np.where(one == other, 1.0, 2.0) * covariance[new][:, one, other]
        return np.asarray((twice @ _products(self.weights, self.weights).T)[np.cumsum(new) - 1])

    def at(self, columns: slice | IntArray) -> MotionFactors:
        """The same factors of some columns."""
        return MotionFactors(self.mean[columns], self.weights[columns], self.noise[columns])

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


def fill_by_factors(X: FloatArray, count: int = FILLING) -> FloatArray:
    """Replace every NaN of rows (n, d) by what some factors of all columns make of the others.

    In proportion to rows and columns; every column has at least one observation.
    """
    hidden = np.isnan(X)
    if not hidden.any():
        return X
    units = units_of(X)
    given = units.apply(X)
    guess = np.nan_to_num(given[:, part_of(X.shape[1])])
    factors = MotionFactors.learned(given, guess, 0.0, min(count, len(X) - 1))
    z, _ = factors.posterior(given)
    return np.where(hidden, units.undo(factors.frames(z)), X)


def units_of(X: FloatArray) -> Normalisation:
    """The normalisation of frames (n, d), NaN: not observed; also of such that do not move."""
    parts = [X[:, columns] for columns in blocks(X.shape[1], len(X))]
    mean = np.concatenate([np.nanmean(part, axis=0) for part in parts])
    return Normalisation(mean, max(float(deviation(part).max()) for part in parts) or 1.0)


def part_of(columns: int) -> IntArray:
    """The columns that factors are learned from."""
    return spread(columns, PART)


def _pairs(q: int) -> tuple[IntArray, IntArray]:
    """Rows and columns of the upper half of a symmetric matrix (q, q), each (q (q + 1) / 2,)."""
    one, other = np.triu_indices(q)
    return one, other


def _products(left: FloatArray, right: FloatArray) -> FloatArray:
    """Upper halves of l rᵀ for rows (n, q) of each, (n, q (q + 1) / 2)."""
    one, other = _pairs(left.shape[1])
    return left[:, one] * right[:, other]


def _symmetric(halves: FloatArray, q: int) -> FloatArray:
    """Symmetric matrices (n, q, q) from their upper halves."""
    number = np.empty((q, q), dtype=np.int64)
    one, other = _pairs(q)
    number[one, other] = number[other, one] = np.arange(len(one))
    return halves[:, number]


class _Shown(NamedTuple):
    """What frames show, (n, d), 0 elsewhere; and what they hide, if anything."""

    known: FloatArray
    hidden: BoolArray | None

    @classmethod
    def by(cls, X: FloatArray) -> _Shown:
        """What frames show, NaN: not observed."""
        hidden = np.isnan(X)
        return cls(np.where(hidden, 0.0, X), hidden) if hidden.any() else cls(X, None)

    def at(self, columns: slice) -> _Shown:
        """The same of some columns."""
        hidden = None if self.hidden is None else self.hidden[:, columns]
        return _Shown(self.known[:, columns], hidden)

    def sums(self, values: FloatArray, axis: int = 1) -> FloatArray:
        """Sums of values (d, k) over what each frame shows; or, by axis 0, the other way round.

        Where little is hidden, that is taken off the sum of all.
        """
        total, hidden = values.sum(axis=0), self.hidden
        if hidden is None:
            return np.tile(total, (self.known.shape[1 - axis], 1))
        if FEW * np.count_nonzero(hidden) > hidden.size:
            seen = (~hidden).astype(np.float64)
            return np.asarray((seen if axis else seen.T) @ values)
        sparse = csr_array(hidden, dtype=np.float64)
        return np.asarray(total - (sparse if axis else sparse.T) @ values)


def _maximised(shown: _Shown, z: FloatArray, covariance: FloatArray, least: float) -> MotionFactors:
    """Most likely mean, weights and noise given the factors' posterior."""
    n, q = z.shape
    moments = np.empty((n, q + 1, q + 1))
    moments[:, :q, :q] = covariance + z[:, :, None] * z[:, None, :]
    moments[:, q, :q] = moments[:, :q, q] = z
    moments[:, q, q] = 1.0
    halves, first = moments[:, *_pairs(q + 1)], np.hstack([z, np.ones((n, 1))])
    parts = [
        _regressed(shown.at(columns), halves, first, least)
        for columns in blocks(shown.known.shape[1], (q + 1) ** 2)
    ]
    rows, noise = (np.concatenate(one) for one in zip(*parts, strict=True))
    root = np.linalg.cholesky(moments[:, :q, :q].mean(axis=0))  # z has unit covariance again
    weights = np.asarray(rows[:, :q] @ root, dtype=np.float64)
    return MotionFactors(rows[:, q], weights, noise)


def _regressed(
    shown: _Shown, halves: FloatArray, first: FloatArray, least: float
) -> tuple[FloatArray, FloatArray]:
    """Weights and mean (d, q + 1) and noise (d,) of columns, by moments of [z, 1] in each frame."""
    one, other = _pairs(first.shape[1])
    sums, X = shown.sums(halves, axis=0), shown.known
    pull = X.T @ first
    prior = np.diag([*[ONCE_MORE] * (first.shape[1] - 1), 0.0])
    normal = _symmetric(sums, first.shape[1]) + prior
    rows = np.linalg.solve(normal, pull[:, :, None])[:, :, 0].astype(np.float64)
    left = np.einsum("nd,nd->d", X, X) - 2.0 * (rows * pull).sum(axis=1)
    left += (np.where(one == other, 1.0, 2.0) * sums * _products(rows, rows)).sum(axis=1)
    return rows, np.maximum(left / sums[:, -1], least**2)
