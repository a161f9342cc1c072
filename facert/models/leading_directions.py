"""The leading directions of a source of many columns, and its frames by their scores along them.

A tracked face mesh has thousands of points, and moves in a hundred directions at most: skin next to
skin moves alike. With V (d, r) the principal directions of all frames, and x̄ their mean, a frame is

    x = x̄ + V s + e,      s ~ N(0, Λ),      e ~ N(0, σ² I):

probabilistic principal component analysis (Tipping and Bishop 1999). Whatever depends on distances
and products of frames alone, as kernels and regressions do, is the same for scores as for frames,
up to e; and costs by r instead of d.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.linalg import eigh

from facert.data.array_group import DAMAGED, ArrayGroup
from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.errors import InputError

DENSE = 384
"""Columns, beyond which a source enters by its leading directions: 128 markers."""
RANK = 150
"""r at most. Half of the directions or so show noise alone, and from them it is estimated."""
ITERATIONS, FRAMES_EACH = 8, 4
"""Of expectation maximisation through gaps; and frames for each of its directions, at least."""
LEAST_NOISE = 1e-6
"""Least σ², relative to the mean variance of a column."""


@dataclass(frozen=True, eq=False)
class LeadingDirections(ArrayGroup):
    """Principal directions of frames, in the order of their variance."""

    mean: Annotated[FloatArray, "x"]  # (d,): x̄
    basis: Annotated[FloatArray, "xr"]  # (d, r): V, orthonormal
    variances: Annotated[FloatArray, "r"]  # (r,): The diagonal of Λ
    noise: Annotated[FloatArray, "1"]  # (1,): σ²

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.variances < 0.0).any() or not (self.noise > 0.0).all():
            expected, found = "variances, that of the noise above 0", "others"
            raise InputError("directions.variances", expected, found, DAMAGED)

    @classmethod
    def learned(cls, X: FloatArray) -> LeadingDirections:
        """The leading directions of frames (n, d); NaN: not observed, but once in each column.

        With gaps by a few steps of expectation maximisation: fill, decompose, fill again. The
        largest directions come first, as many would keep whatever was filled in at the start.
        """
        hidden = np.isnan(X)
        if not hidden.any():
            return cls._of_complete(X, RANK)
        most = max(min(RANK, len(X) // FRAMES_EACH), 1)
        filled = np.where(hidden, np.nanmean(X, axis=0), X)
        for count in np.geomspace(1, most, ITERATIONS).round().astype(int).tolist():
            found = cls._of_complete(filled, count)
            filled, _ = found.fill(X)
        return found

    @classmethod
    def _of_complete(cls, X: FloatArray, most: int) -> LeadingDirections:
        mean, d = X.mean(axis=0), X.shape[1]
        centred = X - mean
        variances, basis = _principal(centred, min(most, d))
        total = float(np.vdot(centred, centred)) / len(X)
        left = max(total - float(variances.sum()), 0.0) / max(d - len(variances), 1)
        noise = max(left, LEAST_NOISE * total / d, np.finfo(np.float64).tiny)
        return cls(mean, basis, variances, np.array([noise]))

    @property
    def density(self) -> float:
        """How many columns there are for each that a source of `DENSE` has, square root."""
        return float(np.sqrt(max(len(self.mean) / DENSE, 1.0)))

    def scores(self, X: FloatArray) -> FloatArray:
        """Vᵀ (x - x̄) of complete frames (T, d), (T, r)."""
        return np.asarray(X @ self.basis - self._mean_scores)

    @cached_property
    def _mean_scores(self) -> FloatArray:
        return np.asarray(self.mean @ self.basis)

    def fill(self, X: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Replace every NaN by its conditional mean given the rest of its frame.

        With H the hidden and O the seen rows of V, the posterior of the scores is

            C = (Λ⁻¹ + OᵀO / σ²)⁻¹,      ŝ = C Oᵀ (x - x̄)_seen / σ²,

        where OᵀO = I - HᵀH. The filled frame's scores then have the covariance HᵀH C HᵀH + σ² HᵀH.

        Parameters
        ----------
        X : array, shape (T, d)
            Frames; NaN: not observed.

        Returns
        -------
        filled : array, shape (T, d)
            X itself where it is complete; observed values are never changed.
        variance : array, shape (T, r), or None
            Variance of the filled frames' scores; None where all are complete.
        """
        hidden = np.isnan(X)
        if not hidden.any():
            return X, None
        filled = np.where(hidden, self.mean, X)
        pull = self.scores(filled)  # Oᵀ (x - x̄)_seen
        variance = np.zeros_like(pull)
        for pattern, rows in _by_pattern(hidden):
            H = self.basis[pattern]
            products = H.T @ H
            C = self._covariance(products)
            filled[np.ix_(rows, pattern)] += pull[rows] @ (C / self.noise) @ H.T
            variance[rows] = np.einsum("ij,jk,ki->i", products, C, products, optimize=True)
            variance[rows] += self.noise * products.diagonal()
        return filled, variance

    def _covariance(self, hidden_products: FloatArray) -> FloatArray:
        """C, (r, r), from HᵀH; with Λ^½ taken out of the inverse, as variances may be 0."""
        root = np.sqrt(self.variances)
        seen = np.eye(len(root)) - hidden_products
        inner = np.eye(len(root)) + root[:, None] * seen * root / self.noise
        return np.asarray(root[:, None] * np.linalg.inv(inner) * root)


def principal_variances(X: FloatArray) -> FloatArray:
    """The variances of frames (n, d) along their principal directions, falling, (min(n, d),)."""
    variances = np.linalg.eigvalsh(_products(X - X.mean(axis=0)))[::-1] / len(X)
    return np.asarray(np.maximum(variances, 0.0))


def _products(centred: FloatArray) -> FloatArray:
    """Products of centred frames (n, d) or of their columns, whichever are fewer."""
    n, d = centred.shape
    return np.asarray(centred @ centred.T if n <= d else centred.T @ centred)


def _principal(centred: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """The first variances, falling, and directions (d, count) of centred frames (n, d).

    Frames that span fewer directions are given others at right angles to these, with no variance.
    """
    n, d = centred.shape
    few = min(n, d)
    first = max(few - count, 0)
    values, vectors = eigh(_products(centred), subset_by_index=[first, few - 1])
    values, vectors = np.maximum(values[::-1], 0.0) / n, vectors[:, ::-1]
    spanned = centred.T @ vectors if n <= d else vectors
    padded = np.zeros((d, count))
    padded[:, : spanned.shape[1]] = spanned
    Q, R = np.linalg.qr(padded)
    variances = np.zeros(count)
    variances[: len(values)] = values
    return variances, Q * np.where(R.diagonal() < 0.0, -1.0, 1.0)


def _by_pattern(hidden: BoolArray) -> list[tuple[BoolArray, IntArray]]:
    """Each of the patterns that frames (T, d) hide, (d,), and the rows that hide just that."""
    patterns, of = np.unique(np.packbits(hidden, axis=1), axis=0, return_inverse=True)
    first = [int(np.argmax(of == index)) for index in range(len(patterns))]
    return [
        (hidden[row], np.flatnonzero(of == index))
        for index, row in enumerate(first)
        if hidden[row].any()
    ]
