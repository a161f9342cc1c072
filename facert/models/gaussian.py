"""The Gaussian of frames, and imputation: the conditional mean of hidden values given seen ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.memory import require_square

ITERATIONS = 5
RIDGE = 1e-6  # relative to the mean variance
TOGETHER = 384
"""Columns that gaps are filled by together."""
BLIND = 0.5  # share of a part's columns that a frame hides
CHUNK = 2_000_000  # numbers in the systems that are solved at once


def fill_gaps(X: FloatArray) -> FloatArray:
    """Replace every NaN by its conditional mean under a Gaussian fitted to all frames.

    One Gaussian of all columns takes the square of their number in memory, and the cube in time. Of
    more than `TOGETHER` each is filled by what stands beside it; where a frame hides most of that,
    by columns from everywhere, as a region that is hidden says nothing of itself.

    Parameters
    ----------
    X : array, shape (n, d)
        Frames; NaN: not observed. Every column has at least one observation.

    Returns
    -------
    array, shape (n, d)
        X itself where it is complete; observed values are never changed.
    """
    if not np.isnan(X).any():
        return X
    filled = X.copy()
    for part in _parts(np.isnan(X)):
        filled[:, part] = Gaussian.of(X[:, part]).fill(X[:, part])
    return filled


def _parts(hidden: BoolArray) -> list[IntArray]:
    """Columns that are filled together, where (n, d) are hidden."""
    columns = np.arange(hidden.shape[1])
    count = -(-len(columns) // TOGETHER)
    beside = np.array_split(columns, count)
    some = hidden[~hidden.all(axis=1)]
    blind = any((some[:, part].mean(axis=1) > BLIND).any() for part in beside)
    return [columns[k::count] for k in range(count)] if blind else beside


@dataclass(frozen=True, eq=False)
class Gaussian:
    """A Gaussian distribution of frames."""

    mean: FloatArray  # (d,): Of each column
    covariance: FloatArray  # (d, d): Positive definite

    @classmethod
    def of(cls, X: FloatArray) -> Gaussian:
        """The Gaussian fitted to frames (n, d); NaN: not observed, but once in each column.

        A few steps of expectation maximisation (Little and Rubin 2002, section 11.2): fill,
        estimate mean and covariance (with the fill's own covariance added), fill again.
        """
        require_square(X.shape[1], "/source", "Take fewer markers.")
        hidden = np.isnan(X)
        if not hidden.any():
            return cls._of_complete(X)
        found = cls._of_complete(np.where(hidden, np.nanmean(X, axis=0), X))
        for _ in range(ITERATIONS):
            found = cls._of_complete(found.fill(X), found._summed_covariance(hidden))
        return found

    @classmethod
    def _of_complete(cls, X: FloatArray, input_variance: FloatArray | float = 0.0) -> Gaussian:
        covariance = np.atleast_2d(np.cov(X, rowvar=False, bias=True)) + input_variance / len(X)
        covariance[np.diag_indices_from(covariance)] += RIDGE * np.trace(covariance) / X.shape[1]
        return cls(X.mean(axis=0), covariance)

    @cached_property
    def precision(self) -> FloatArray:
        """P, the inverse of the covariance, (d, d)."""
        return np.linalg.inv(self.covariance).astype(np.float64)

    def fill(self, X: FloatArray) -> FloatArray:
        """Replace every NaN by its conditional mean given the rest of its frame.

        Parameters
        ----------
        X : array, shape (n, d)
            Frames; NaN: not observed.

        Returns
        -------
        array, shape (n, d)
            X itself where it is complete; observed values are never changed.
        """
        filled, _ = self.fill_for(X, np.empty((X.shape[1], 0)))
        return filled

    def fill_for(self, X: FloatArray, B: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Fill frames, with the variance that this leaves in x B, a linear function of a frame.

        Where h is hidden and s is seen,

            x_h = mean_h - P_hh⁻¹ P_hs (x_s - mean_s),      cov(x_h) = P_hh⁻¹,
            var((x B)_j) = (B_hᵀ P_hh⁻¹ B_h)_jj.

        The systems are as large as what is hidden; frames that hide about as much, whatever it is,
        are solved in one batch.

        Parameters
        ----------
        X : array, shape (n, d)
            Frames; NaN: not observed.
        B : array, shape (d, m)

        Returns
        -------
        filled : array, shape (n, d)
            X itself where it is complete; observed values are never changed.
        variance : array, shape (n, m)
            Zero for frames that are complete.
        """
        hidden = np.isnan(X)
        variance = np.zeros((len(X), B.shape[1]))
        if not hidden.any():
            return X, variance
        pull = _padded(np.where(hidden, 0.0, X - self.mean) @ self.precision)
        filled = _padded(np.where(hidden, self.mean, X))
        unseen = np.asarray(
            hidden.all(axis=1)
        )  # of these frames nothing says more than the distribution
        variance[unseen] = np.einsum("dm,dm->m", B, self.covariance @ B)
        P, B = self._padded_precision, np.vstack([B, np.zeros(B.shape[1])])
        for rows, columns in _batches(hidden & ~unseen[:, None], B.shape[1]):
            sides = np.concatenate([pull[rows[:, None], columns][:, :, None], B[columns]], axis=2)
            solved = np.linalg.solve(_blocks(P, columns), sides)
            filled[rows[:, None], columns] -= solved[:, :, 0]
            spread = np.einsum("bhm,bhm->bm", sides[:, :, 1:], solved[:, :, 1:])
            variance[rows] = np.maximum(spread, 0.0)  # rounding may take it below
        return filled[:, : X.shape[1]].copy(), variance

    def _summed_covariance(self, hidden: BoolArray) -> FloatArray:
        """The conditional covariances P_hh⁻¹ of all frames, summed, (d, d)."""
        d, P = len(self.covariance), self._padded_precision
        total = np.zeros(P.size)
        unseen = np.asarray(hidden.all(axis=1))
        for _, columns in _batches(hidden & ~unseen[:, None]):
            places = columns[:, :, None] * len(P) + columns[:, None, :]
            inverses = np.linalg.inv(_blocks(P, columns))
            total += np.bincount(places.ravel(), inverses.ravel(), minlength=P.size)
        return np.asarray(total.reshape(P.shape)[:d, :d] + unseen.sum() * self.covariance)

    @cached_property
    def _padded_precision(self) -> FloatArray:
        """P with a row and a column of zeros, (d + 1, d + 1), see `_batches`."""
        return np.pad(self.precision, (0, 1))


def _batches(hidden: BoolArray, width: int = 0) -> Iterator[tuple[IntArray, IntArray]]:
    """Batches of the frames (n, d) that hide anything, those that hide most first.

    Each batch is the rows of its frames, (b,), and the columns that each of them hides, (b, h). A
    frame that hides fewer than h is filled up with d, the index of a padding column. Batches are
    cut so that (h, h) and (h, width) numbers can be kept for each of their frames.
    """
    d = hidden.shape[1]
    counts = hidden.sum(axis=1)
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    first = 0
    while first < len(order):
        widest = int(counts[order[first]])
        rows = order[first : first + max(CHUNK // (widest * max(widest, width)), 1)]
        columns = np.argsort(~hidden[rows], axis=1, kind="stable")[:, :widest]
        real = np.arange(widest) < counts[rows, None]
        yield rows, np.where(real, columns, d)
        first += len(rows)


def _padded(X: FloatArray) -> FloatArray:
    """X (n, d) with a column of zeros beside it, (n, d + 1), see `_batches`."""
    return np.hstack([X, np.zeros((len(X), 1))])  # np.pad takes ten times as long


def _blocks(P: FloatArray, columns: IntArray) -> FloatArray:
    """P_hh of each frame, (b, h, h), with the identity where columns (b, h) are padding."""
    blocks = P.ravel().take(columns[:, :, None] * len(P) + columns[:, None, :])
    np.einsum("bhh->bh", blocks)[...] += columns == len(P) - 1  # einsum: a view of the diagonals
    return blocks
