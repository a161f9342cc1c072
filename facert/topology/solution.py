"""The solution (18), (19): from labels to all points, for any quadratic energy trace(Yᵀ B Y).

The minimiser is linear in the labels, so that one factorisation serves every coordinate and every
frame; and where labels are few, the matrix A with Y = A Ŷ, the *influence* of each label on each
point, is found once and a frame costs one product.

Labels are met exactly: β → ∞ in (17). From 10⁴ on (18) as it is written is as good as that, since B
has no unit. Points are rows here and columns in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from facert.data.arrays import FloatArray, IntArray
from facert.errors import InputError
from facert.models.threads import one_thread

SINGULAR = 1e-13
"""A pivot below this share of the largest diagonal entry is rounding."""


@dataclass(frozen=True, eq=False)
class Dense:
    """A linear map from M labelled points to all N, known by its influence matrix."""

    influence: FloatArray  # (N, M): A: how much of each label reaches each point; rows add up to 1

    def __call__(self, labels: FloatArray) -> FloatArray:
        """Points Y = A Ŷ, (N, ...), from labels (M, ...); any number of coordinates."""
        flat = labels.reshape(len(labels), -1)
        with one_thread():
            # Transposed: BLAS is quicker at (few, M) times (M, N) than the other way round.
            found = (flat.T @ self.influence.T).T
        return np.asarray(found.reshape(-1, *labels.shape[1:]))


class Elimination:
    """The linear map from labels to the points of least energy, by sparse elimination.

    With β → ∞, B₂₂ Y₂ = -B₁₂ᵀ Ŷ is left of (18).

    Parameters
    ----------
    B : sparse array, shape (N, N)
        Symmetric, positive semidefinite.
    labelled : array of int, shape (M,)
        Different points.

    Raises
    ------
    InputError
        When the labels do not determine all points.
    """

    def __init__(self, B: sparse.csc_array, labelled: IntArray) -> None:
        self._points, self._labelled = B.shape[0], labelled
        self._free = np.setdiff1d(np.arange(B.shape[0]), labelled)
        columns = B[:, self._free]
        self._B12 = columns[labelled]
        self._lu = _factorised(columns[self._free], self._free) if len(self._free) else None

    @property
    def influence(self) -> FloatArray:
        """A, (N, M): the solution for labels that are 1 at one point and 0 at the others."""
        return self(np.eye(len(self._labelled)))

    def __call__(self, labels: FloatArray) -> FloatArray:
        """Y = [Ŷ, -B₂₂⁻¹ B₁₂ᵀ Ŷ] (19) in the order of the points, (N, ...)."""
        flat = labels.reshape(len(labels), -1)
        Y = np.empty((self._points, flat.shape[1]))
        Y[self._labelled] = flat
        Y[self._free] = self._solved(-(self._B12.T @ flat))
        return Y.reshape(self._points, *labels.shape[1:])

    def green(self, point: int) -> FloatArray:
        """Response of all points to a unit force on one of them, (N,): a column of B₂₂⁻¹."""
        response = np.zeros(self._points)
        force = (self._free == point).astype(np.float64)
        response[self._free] = self._solved(force[:, None])[:, 0]
        return response

    def _solved(self, right: FloatArray) -> FloatArray:
        """Solve B₂₂⁻¹ times a matrix, at the free points."""
        if self._lu is None:
            return right
        with one_thread():
            return np.asarray(self._lu.solve(np.asfortranarray(right)))


Interpolant = Dense | Elimination


def _factorised(A: sparse.csc_array, points: IntArray) -> SuperLU:
    """A sparse factorisation of a symmetric positive definite matrix, of energies at some points.

    SuperLU in symmetric mode: the diagonal makes good pivots, and minimum degree on A + Aᵀ keeps
    the factors small. It asks BLAS for thousands of tiny products: one thread is quickest.
    """
    diagonal = A.diagonal()
    least = SINGULAR * diagonal.max()
    lost = np.flatnonzero(diagonal <= least)
    if len(lost):
        raise _undetermined(int(points[lost[0]]))
    try:
        with one_thread():
            options = {"SymmetricMode": True}
            lu = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:  # a pivot of 0
        raise _undetermined(int(points[0])) from error
    pivots = np.abs(lu.U.diagonal())
    if pivots.min() <= least:
        raise _undetermined(int(points[np.flatnonzero(lu.perm_c == pivots.argmin())[0]]))
    return lu


def _undetermined(point: int) -> InputError:
    return InputError(
        "labels",
        "labels that determine every point",
        f"point {point} and those around it left free",
        "Add labels there, not all on one line or plane; or use a method with a Laplacian.",
    )
