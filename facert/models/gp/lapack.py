"""The likelihood's value and closed-form gradient by LAPACK and BLAS, in place.

The formulas are those of `facert.models.gp.likelihood`, on arrays in the CPU's memory. Every matrix
is symmetric and only its lower triangle is kept; three calls to LAPACK and BLAS have a cost that
grows with n³, and the rest passes over n² numbers. torch's own operations take twice as long.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg.blas import dsymm, dsymv, dsyrk
from scipy.linalg.lapack import dlauum

from facert.data.arrays import FloatArray
from facert.models.gp.jitter import inverted, lower_factor
from facert.models.kernels import Kernel, SquaredExponential


def value_and_gradient(
    Z: FloatArray,
    log_kernel: FloatArray,
    F: FloatArray,
    columns: int,
    noise_floor: float,
    kernel: type[Kernel] = SquaredExponential,
) -> tuple[float, FloatArray, FloatArray]:
    """-log P(X|Z) and its derivatives with respect to Z and the log-kernel parameters.

    Parameters are those of `facert.models.gp.likelihood.negative_log_likelihood`, as arrays, F
    C-contiguous.

    Returns
    -------
    value : float
    dZ : array, shape (n, q)
    d_log_kernel : array, shape (3,)

    Raises
    ------
    NumericalError
        When the kernel matrix is not positive definite within the jitter ladder.
    """
    n = len(Z)
    # Parameters far off overflow; `lower_factor` then finds what cannot be factorised.
    with np.errstate(over="ignore", invalid="ignore"):
        k = kernel.from_log(log_kernel, noise_floor)
        squared = _squared_distances(Z)
        K, slope = k.value(squared), k.relative_slope(squared)
        del squared  # so that its memory serves the factor
        diagonal = np.einsum("nn->n", K)  # a view
        diagonal += k.noise
    L = lower_factor(K)
    diagonal[...] = k.variance  # from here on K is without its noise
    log_determinant = 2.0 * float(np.log(L.diagonal()).sum())
    K_inverse, _ = dlauum(inverted(L), lower=1, overwrite_c=1)  # L⁻ᵀ L⁻¹
    # Fᵀ and Aᵀ: what is C-contiguous to NumPy is their transpose to Fortran.
    A_T = dsymm(1.0, K_inverse, F.T, side=1, lower=1)
    value = 0.5 * (
        columns * log_determinant + float(np.vdot(F, A_T.T)) + n * columns * math.log(2.0 * math.pi)
    )  # Eq. (1)

    G = dsyrk(-0.5, A_T, beta=0.5 * columns, c=K_inverse, trans=1, lower=1, overwrite_c=1)
    d_noise = math.exp(log_kernel[2]) * float(G.diagonal().sum())
    d_variance, product = _sums(np.multiply(G, K, out=G), slope, Z)
    dZ = product[:, -1:] * Z - product[:, :-1]
    return value, dZ, np.array([d_variance, 0.5 * float(np.vdot(Z, dZ)), d_noise])


def _sums(W: FloatArray, slope: FloatArray | float, Z: FloatArray) -> tuple[float, FloatArray]:
    """Σ W and 4 V [Z, 1], (n, q + 1), where V = W ∘ slope; W is overwritten."""
    ones = np.ones(len(Z))
    right = np.column_stack([Z, ones]).T
    if isinstance(slope, float):  # 4 V 1 gives Σ W as well
        product = dsymm(4.0 * slope, W, right, side=1, lower=1).T
        return float(product[:, -1].sum()) / (4.0 * slope), product
    total = float(dsymv(1.0, W, ones, lower=1).sum())
    return total, dsymm(4.0, np.multiply(W, slope, out=W), right, side=1, lower=1).T


def _squared_distances(Z: FloatArray) -> FloatArray:
    """|z_i - z_j|² to rounding, (n, n), in Fortran's order, zero on the diagonal."""
    squares, ones = np.einsum("nq,nq->n", Z, Z), np.ones(len(Z))
    # |z_i|² + |z_j|² - 2 z_i z_j in one product.
    S: FloatArray = (
        np.column_stack([-2.0 * Z, ones, squares]) @ np.column_stack([Z, squares, ones]).T
    )
    np.fill_diagonal(S, 0.0)  # rounding must not make it anything else
    return S.T
