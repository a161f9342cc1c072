"""Kernel ridge regression and its leave-one-out errors, in closed form.

With a kernel K (n, n) and a penalty λ, rows Y (n, d) have the weights

    α = (K + λ I)⁻¹ Y,

and the fit without row i misses it by

    α_i / ((K + λ I)⁻¹)_ii

(Rasmussen and Williams 2006, Eq. (5.12), with λ for the variance of the noise). One decomposition
K = U diag(v) Uᵀ gives both for every penalty: (K + λ I)⁻¹ = U diag(1/(v + λ)) Uᵀ.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from facert.data.arrays import FloatArray


def leave_one_out_errors(weights: FloatArray, diagonal: FloatArray) -> FloatArray:
    """Truth less prediction for every row when it alone is left out, (..., n, d).

    Parameters
    ----------
    weights : array, shape (..., n, d)
        α.
    diagonal : array, shape (..., n)
        The diagonal of (K + λ I)⁻¹.
    """
    return np.asarray(weights / diagonal[..., None])


@dataclass(frozen=True, eq=False)
class KernelRidge:
    """Regressions of Y on one kernel with any penalty; leading axes hold several at once."""

    # (..., n) and (..., n, n): v and U
    values: FloatArray
    vectors: FloatArray
    projected: FloatArray  # (..., n, d): Uᵀ Y

    @classmethod
    def of(cls, K: FloatArray, Y: FloatArray) -> Self:
        """Regressions of Y (..., n, d) on a positive semi-definite kernel K (..., n, n)."""
        values, vectors = np.linalg.eigh(K)
        return cls(np.maximum(values, 0.0), vectors, vectors.swapaxes(-1, -2) @ Y)

    def weights(self, penalty: float | FloatArray) -> FloatArray:
        """α, (..., n, d), with one penalty for all columns of Y or one for each, (d,)."""
        inverse = 1.0 / (self.values[..., None] + penalty)
        return np.asarray(self.vectors @ (inverse * self.projected))

    def diagonal(self, penalty: float) -> FloatArray:
        """The diagonal of (K + λ I)⁻¹, (..., n)."""
        inverse = 1.0 / (self.values + penalty)
        return np.asarray(np.vecdot(self._squares, inverse[..., None, :]))

    def errors(self, penalty: float) -> FloatArray:
        """Leave-one-out errors with one penalty, (..., n, d)."""
        return leave_one_out_errors(self.weights(penalty), self.diagonal(penalty))

    @cached_property
    def _squares(self) -> FloatArray:
        return np.asarray(self.vectors**2)


@dataclass(frozen=True, eq=False)
class LinearRidge(KernelRidge):
    """Ridge regression of Y on X: the kernel X Xᵀ, decomposed without forming it.

    Small penalties would be lost in the rounding of X Xᵀ.
    """

    pull: FloatArray  # (d_x, r): V diag(S) of X = U diag(S) Vᵀ, r the smaller of n and d_x

    @classmethod
    def of_inputs(cls, X: FloatArray, Y: FloatArray) -> Self:
        """The regression of Y (n, d) on inputs X (n, d_x)."""
        U, S, Vt = np.linalg.svd(X, full_matrices=len(X) > X.shape[1])
        values = np.pad(S**2, (0, len(X) - len(S)))
        return cls(values, U, U.T @ Y, Vt[: len(S)].T * S)

    def slopes(self, penalty: float | FloatArray) -> FloatArray:
        """W (d_x, d) of the regression y = x W, with one penalty or one for each column of Y."""
        rank = self.pull.shape[1]
        return np.asarray(
            self.pull @ (self.projected[:rank] / (self.values[:rank, None] + penalty))
        )
