"""Filling what was not observed in a set of frames from what was."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from facert.data import BoolArray, FloatArray, IntArray

ITERATIONS = 5
RIDGE = 1e-6  # relative to the mean variance
CHUNK = 2_000_000  # numbers in the systems that are solved at once


def fill_gaps(X: FloatArray) -> FloatArray:
    """Replace every NaN by its conditional mean under a Gaussian fitted to all frames.

    Parameters
    ----------
    X : array, shape (n, d)
        Frames; NaN: not observed. Every column has at least one observation.

    Returns
    -------
    array, shape (n, d)
        X itself where it is complete; observed values are never changed.
    """
    return Gaussian.of(X).fill(X) if np.isnan(X).any() else X


@dataclass(frozen=True, eq=False)
class Gaussian:
    """The distribution of frames, which tells what a frame hides from what it shows.

    Parameters
    ----------
    mean : array, shape (d,)
        Of each column.
    covariance : array, shape (d, d)
        Positive definite.
    """

    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, X: FloatArray) -> Gaussian:
        """Fitted to frames (n, d); NaN: not observed. Every column has at least one observation.

        A few steps of expectation maximisation (Little and Rubin 2002, section 11.2): fill,
        estimate mean and covariance (with the fill's own covariance added), fill again.
        """
        hidden = np.isnan(X)
        if not hidden.any():
            return cls._of_complete(X)
        found = cls._of_complete(np.where(hidden, np.nanmean(X, axis=0), X))
        for _ in range(ITERATIONS):
            found = cls._of_complete(found.fill(X), found._doubt(hidden))
        return found

    @classmethod
    def _of_complete(cls, X: FloatArray, doubt: FloatArray | float = 0.0) -> Gaussian:
        covariance = np.atleast_2d(np.cov(X, rowvar=False, bias=True)) + doubt / len(X)
        covariance[np.diag_indices_from(covariance)] += RIDGE * np.trace(covariance) / X.shape[1]
        return cls(X.mean(axis=0), covariance)

    @cached_property
    def precision(self) -> FloatArray:
        """P, the inverse of the covariance, (d, d)."""
        return np.linalg.inv(self.covariance).astype(np.float64)

    def fill(self, X: FloatArray) -> FloatArray:
        """Replace every NaN by its conditional mean given the rest of its frame.

        Where h is hidden and s is seen, x_h = mean_h - P_hh⁻¹ P_hs (x_s - mean_s). The systems are
        as large as what is hidden; frames that hide about as much, whatever it is, are solved in
        one batch.

        Parameters
        ----------
        X : array, shape (n, d)
            Frames; NaN: not observed.

        Returns
        -------
        array, shape (n, d)
            X itself where it is complete; observed values are never changed.
        """
        hidden = np.isnan(X)
        if not hidden.any():
            return X
        pull = np.where(hidden, 0.0, X - self.mean) @ self.precision
        filled = np.where(hidden, self.mean, X)
        for batch in _batches(hidden):
            P_hh, rhs = batch.part(self.precision), batch.take(pull)[:, :, None]
            batch.subtract(filled, np.linalg.solve(P_hh, rhs)[:, :, 0])
        return filled

    def _doubt(self, hidden: BoolArray) -> FloatArray:
        """The conditional covariances P_hh⁻¹ of all frames, summed, (d, d)."""
        total = np.zeros_like(self.covariance)
        for batch in _batches(hidden):
            batch.add_square(total, np.linalg.inv(batch.part(self.precision)))
        return total


@dataclass(frozen=True, eq=False)
class _Batch:
    """B frames, and which h columns each of them hides.

    A frame that hides fewer is filled up with columns that it shows; `real` tells them apart.
    """

    rows: IntArray  # (B,)
    columns: IntArray  # (B, h)
    real: BoolArray  # (B, h)

    def part(self, P: FloatArray) -> FloatArray:
        """P_hh of each frame, (B, h, h), with the identity where it is filled up."""
        blocks = P[self.columns[:, :, None], self.columns[:, None, :]]
        return np.where(self._both, blocks, np.eye(self.columns.shape[1]))

    def take(self, X: FloatArray) -> FloatArray:
        """The hidden entries of X (n, d), (B, h), with zero where they are filled up."""
        return np.where(self.real, X[self.rows[:, None], self.columns], 0.0)

    def subtract(self, X: FloatArray, values: NDArray[np.floating]) -> None:
        """Take (B, h) from the hidden entries of X (n, d), in place."""
        X[self.rows[:, None], self.columns] -= np.where(self.real, values, 0.0)

    def add_square(self, total: FloatArray, blocks: NDArray[np.floating]) -> None:
        """Add every frame's (h, h) to the hidden rows and columns of total (d, d), in place."""
        places = self.columns[:, :, None] * len(total) + self.columns[:, None, :]
        sums = np.bincount(places[self._both], blocks[self._both], minlength=total.size)
        total += sums.reshape(total.shape)

    @property
    def _both(self) -> BoolArray:
        return self.real[:, :, None] & self.real[:, None, :]


def _batches(hidden: BoolArray) -> Iterator[_Batch]:
    """The frames that hide anything, (n, d), those that hide most first."""
    counts = hidden.sum(axis=1)
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    first = 0
    while first < len(order):
        widest = int(counts[order[first]])
        rows = order[first : first + max(CHUNK // widest**2, 1)]
        columns = np.argsort(~hidden[rows], axis=1, kind="stable")[:, :widest]
        yield _Batch(rows, columns, np.take_along_axis(hidden[rows], columns, axis=1))
        first += len(rows)
