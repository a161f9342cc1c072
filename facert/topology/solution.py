"""The solution (18), (19): from labels to all points, for any quadratic energy trace(Yᵀ B Y).

The minimiser is linear in the labels, so that one factorisation serves every coordinate and every
frame; and where labels are few, the matrix A with Y = A Ŷ, the *influence* of each label on each
point, is found once and a frame costs one product.

Points are rows here and columns in the paper.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from threadpoolctl import ThreadpoolController

from facert.data.arrays import FloatArray, IntArray
from facert.errors import InputError

SINGULAR = 1e-13
"""A pivot below this share of the largest diagonal entry is rounding."""


class Interpolant(ABC):
    """A linear map from what is given at M labelled points to all N points."""

    @property
    @abstractmethod
    def influence(self) -> FloatArray:
        """A, (N, M): how much of each label reaches each point; rows add up to 1."""

    @abstractmethod
    def __call__(self, labels: FloatArray) -> FloatArray:
        """All points (N, ...) from labels (M, ...); any number of coordinates and frames."""


@dataclass(frozen=True, eq=False)
class Dense(Interpolant):
    """An interpolant that is known by its influence matrix alone.

    Parameters
    ----------
    matrix : array, shape (N, M)
    """

    matrix: FloatArray

    @property
    def influence(self) -> FloatArray:
        """The matrix itself."""
        return self.matrix

    def __call__(self, labels: FloatArray) -> FloatArray:
        """A Ŷ."""
        flat = labels.reshape(len(labels), -1)
        with one_thread():
            # Transposed: BLAS is quicker at (few, M) times (M, N) than the other way round.
            found = (flat.T @ self.matrix.T).T
        return np.asarray(found.reshape(-1, *labels.shape[1:]))


class _Solved(Interpolant):
    """An interpolant that solves a system for whatever labels it is given."""

    _labelled: IntArray

    @cached_property
    def influence(self) -> FloatArray:
        """A, (N, M): the solution for labels that are 1 at one point and 0 at the others."""
        return self(np.eye(len(self._labelled)))


class Elimination(_Solved):
    """Labels met exactly: β → ∞ in (17), where B₂₂ Y₂ = -B₁₂ᵀ Ŷ is left of (18).

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
        self._solver = _Factor(columns[self._free], self._free) if len(self._free) else None

    def __call__(self, labels: FloatArray) -> FloatArray:
        """Y = [Ŷ, -B₂₂⁻¹ B₁₂ᵀ Ŷ] in the order of the points."""
        flat = labels.reshape(len(labels), -1)
        Y = np.empty((self._points, flat.shape[1]))
        Y[self._labelled] = flat
        if self._solver is not None:
            Y[self._free] = self._solver(-(self._B12.T @ flat))
        return Y.reshape(self._points, *labels.shape[1:])

    def green(self, point: int) -> FloatArray:
        """How all points give way to a unit force on one of them, (N,): a column of B₂₂⁻¹."""
        response = np.zeros(self._points)
        if self._solver is not None:
            response[self._free] = self._solver((self._free == point).astype(np.float64)[:, None])[
                :, 0
            ]
        return response


class Weighted(_Solved):
    """Labels met as well as the weight β asks: (18) as it is written.

    Parameters
    ----------
    B : sparse array, shape (N, N)
        Symmetric, positive semidefinite.
    labelled : array of int, shape (M,)
        Different points.
    beta : float
        β > 0. From 10⁴ on the labels are as good as exact, since B has no unit.

    Raises
    ------
    InputError
        When the labels do not determine all points.
    """

    def __init__(self, B: sparse.csc_array, labelled: IntArray, beta: float) -> None:
        if not (np.isfinite(beta) and beta > 0):
            raise InputError("beta", "a positive number", f"{beta}", "For instance 1e4.")
        self._labelled, self._beta = labelled, beta
        weights = np.zeros(B.shape[0])
        weights[labelled] = beta
        self._points = B.shape[0]
        self._solver = _Factor(B + sparse.diags_array(weights), np.arange(B.shape[0]))

    def __call__(self, labels: FloatArray) -> FloatArray:
        """Y of (19)."""
        flat = labels.reshape(len(labels), -1)
        right = np.zeros((self._points, flat.shape[1]))
        right[self._labelled] = self._beta * flat
        return self._solver(right).reshape(self._points, *labels.shape[1:])


class _Factor:
    """A sparse factorisation of a symmetric positive definite matrix, and its solutions.

    SuperLU in symmetric mode: the diagonal makes good pivots, and minimum degree on A + Aᵀ keeps
    the factors small.
    """

    def __init__(self, A: sparse.csc_array, points: IntArray) -> None:
        diagonal = A.diagonal()
        lost = np.flatnonzero(diagonal <= SINGULAR * diagonal.max(initial=0.0))
        if len(lost):
            raise _undetermined(int(points[lost[0]]))
        try:
            with one_thread():
                self._lu = splu(
                    A.tocsc(),
                    permc_spec="MMD_AT_PLUS_A",
                    diag_pivot_thresh=0.0,
                    options={"SymmetricMode": True},
                )
        except RuntimeError as error:  # exactly singular
            raise _undetermined(int(points[0])) from error
        pivots = np.abs(self._lu.U.diagonal())
        if pivots.min() <= SINGULAR * diagonal.max():
            place = np.flatnonzero(self._lu.perm_c == pivots.argmin())[0]
            raise _undetermined(int(points[place]))

    def __call__(self, right: FloatArray) -> FloatArray:
        with one_thread():
            return np.asarray(self._lu.solve(np.asfortranarray(right)))


def one_thread() -> AbstractContextManager[object]:
    """Run the block with one BLAS thread.

    SuperLU asks BLAS for thousands of tiny products; on a busy machine, two threads at each have
    been measured ten times slower than one.
    """
    limited: AbstractContextManager[object] = _controller().limit(limits=1)
    return limited


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()  # finding the loaded libraries takes milliseconds


def _undetermined(point: int) -> InputError:
    return InputError(
        "labels",
        "labels that determine every point",
        f"point {point} and those around it left free",
        "Add labels there, not all on one line or plane; or use a method with a Laplacian.",
    )
