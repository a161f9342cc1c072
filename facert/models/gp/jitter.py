"""Cholesky factorisation with a jitter ladder that reports itself, on NumPy's arrays.

For torch's tensors see `facert.models.gp.cholesky`, which climbs the same ladder.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from scipy.linalg.blas import dtrmm
from scipy.linalg.lapack import dpotrf, dtrtri

from facert.data.arrays import FloatArray
from facert.errors import NumericalError

if TYPE_CHECKING:  # importing it takes seconds
    from torch import Tensor

log = logging.getLogger(__name__)

JITTER_LADDER = (1e-12, 1e-10, 1e-8, 1e-6)  # relative to the mean of the diagonal
# Triangles of sizes between are inverted by halves: LAPACK in one go takes up to twice as long.
SMALL, LARGE = 64, 600

Matrix = TypeVar("Matrix", FloatArray, "Tensor")


def climb(K: Matrix, factorise: Callable[[float], Matrix | None]) -> Matrix:
    """The factor at the first rung of the ladder that gives one.

    Parameters
    ----------
    K : array or Tensor, shape (n, n)
    factorise : callable
        Factor of K with so much on its diagonal; None if that is not positive definite.

    Raises
    ------
    NumericalError
        When K holds NaN or infinity, or no rung helps.
    """
    factor = factorise(0.0)
    if factor is not None:
        return factor
    # Jitter cannot mend NaN, so look for it before the ladder is tried.
    if not math.isfinite(float(abs(K).max())):
        raise NumericalError("the kernel matrix holds NaN or infinity")
    n, scale = len(K), float(K.diagonal().mean())
    for rung in JITTER_LADDER:
        factor = factorise(rung * scale)
        if factor is not None:
            log.warning("added %.1e to the diagonal of a %d x %d kernel", rung * scale, n, n)
            return factor
    raise NumericalError(
        f"a {n} x {n} kernel matrix is not positive definite, even with "
        f"{JITTER_LADDER[-1] * scale:.1e} on its diagonal: raise the noise floor"
    )


def lower_factor(K: FloatArray) -> FloatArray:
    """The lower Cholesky factor of a symmetric positive definite matrix.

    Parameters
    ----------
    K : array, shape (n, n)
        Quickest in Fortran's order, of which only the lower triangle is read.

    Returns
    -------
    array, shape (n, n)
        L with L Lᵀ = K + jitter I, in Fortran's order. Its upper triangle means nothing.

    Raises
    ------
    NumericalError
        See `climb`.
    """

    def factorise(jitter: float) -> FloatArray | None:
        L, failed = dpotrf(K + jitter * np.eye(len(K)) if jitter else K, lower=1, clean=0)
        # LAPACK takes infinity on the diagonal for positive.
        return L if not failed and np.isfinite(L.diagonal()).all() else None

    return climb(K, factorise)


def inverted(L: FloatArray) -> FloatArray:
    """The inverse of a lower triangular matrix (n, n), in Fortran's order, perhaps in its place.

    The upper triangles are not read, and mean nothing.
    """
    if not SMALL < len(L) < LARGE:
        return np.asarray(dtrtri(L, lower=1, overwrite_c=1)[0])
    half = len(L) // 2
    upper, lower = inverted(L[:half, :half]), inverted(L[half:, half:])
    inverse = np.zeros_like(L, order="F")
    inverse[:half, :half], inverse[half:, half:] = upper, lower
    beside = dtrmm(-1.0, upper, L[half:, :half], side=1, lower=1)
    inverse[half:, :half] = dtrmm(1.0, lower, beside, lower=1, overwrite_b=1)
    return inverse


def whitener(K: FloatArray) -> FloatArray:
    """L⁻¹ (n, n), where L Lᵀ = K; see `lower_factor`."""
    return np.tril(inverted(lower_factor(K)))
