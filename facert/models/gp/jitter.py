"""Cholesky factorisation with a jitter ladder that reports itself, on NumPy's arrays.

For torch's tensors see `facert.models.gp.cholesky`, which climbs the same ladder.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from scipy.linalg.blas import dtrmm
from scipy.linalg.lapack import dpotrf, dtrtri

from facert.data.arrays import FloatArray
from facert.errors import NumericalError

log = logging.getLogger(__name__)

# Relative to the mean of the diagonal. The first rung is the matrix as it is.
JITTER_LADDER = (0.0, 1e-12, 1e-10, 1e-8, 1e-6)
# Triangles of sizes between are inverted by halves: LAPACK in one go takes up to twice as long.
SMALL, LARGE = 64, 600

T = TypeVar("T")


def climb(factorise: Callable[[float], T | None], size: int, scale: float) -> T:
    """The factor at the first rung that gives one.

    Parameters
    ----------
    factorise : callable
        Factor of the matrix with so much on its diagonal; None if that is not positive definite.
    size : int
        Rows of the matrix.
    scale : float
        Mean of its diagonal.

    Raises
    ------
    NumericalError
        When no rung helps.
    """
    for rung in JITTER_LADDER:
        factor = factorise(rung * scale)
        if factor is not None:
            if rung:
                log.warning(
                    "added %.1e to the diagonal of a %d x %d kernel", rung * scale, size, size
                )
            return factor
    raise NumericalError(
        f"a {size} x {size} kernel matrix is not positive definite, even with "
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
        When the matrix holds NaN or infinity, or no rung of the ladder helps.
    """
    L, failed = dpotrf(K, lower=1, clean=0)
    # LAPACK takes infinity on the diagonal for positive.
    if not failed and np.isfinite(L.diagonal()).all():
        return np.asarray(L)
    # Jitter cannot mend NaN, so look for it before the ladder is tried.
    if not np.isfinite(K).all():
        raise NumericalError("the kernel matrix holds NaN or infinity")

    def factorise(jitter: float) -> FloatArray | None:
        L, failed = dpotrf(K + jitter * np.eye(len(K)), lower=1, clean=0)
        return None if failed else np.asarray(L)

    return climb(factorise, len(K), float(K.diagonal().mean()))


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
