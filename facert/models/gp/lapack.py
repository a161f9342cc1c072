"""The likelihood's value and closed-form gradient by LAPACK and BLAS, in place.

The formulas are those of `facert.models.gp.likelihood`, on arrays in the CPU's memory. Every matrix
is symmetric and only its lower triangle is kept; three calls to LAPACK and BLAS have a cost that
grows with n³, and the rest passes over n² numbers. torch's own operations take twice as long.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg.blas import dsymm, dsyrk
from scipy.linalg.lapack import dlauum

from facert.data.arrays import FloatArray
from facert.models.gp.jitter import inverted, lower_factor


def value_and_gradient(
    Z: FloatArray, log_kernel: FloatArray, F: FloatArray, columns: int, noise_floor: float
) -> tuple[float, FloatArray, FloatArray]:
    """-log P(X|Z) and its derivatives with respect to Z and the log-kernel parameters.

    Parameters
    ----------
    Z : array, shape (n, q)
        Positions.
    log_kernel : array, shape (3,)
        (log θ1, log θ2, log of the noise variance above the floor).
    F : array, shape (n, r)
        F Fᵀ = X Xᵀ, C-contiguous.
    columns : int
        d, the number of columns of X.
    noise_floor : float
        Least noise variance.

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
        _, theta2, excess = np.exp(log_kernel).tolist()
        K_smooth = _smooth_kernel(Z, float(log_kernel[0]), theta2)
        K = K_smooth.copy(order="F")
        np.einsum("nn->n", K)[...] += excess + noise_floor  # einsum: a view of the diagonal
    L = lower_factor(K)
    log_determinant = 2.0 * float(np.log(L.diagonal()).sum())
    K_inverse, _ = dlauum(inverted(L), lower=1, overwrite_c=1)  # L⁻ᵀ L⁻¹
    # Fᵀ and Aᵀ: what is C-contiguous to NumPy is their transpose to Fortran.
    A_T = dsymm(1.0, K_inverse, F.T, side=1, lower=1)
    value = 0.5 * (
        columns * log_determinant + float(np.vdot(F, A_T.T)) + n * columns * math.log(2.0 * math.pi)
    )

    G = dsyrk(-0.5, A_T, beta=0.5 * columns, c=K_inverse, trans=1, lower=1, overwrite_c=1)
    d_excess = excess * float(G.diagonal().sum())
    W = np.multiply(G, K_smooth, out=G)
    product = dsymm(1.0, W, np.column_stack([Z, np.ones(n)]).T, side=1, lower=1).T
    row_sums = product[:, -1]
    dZ = (-2.0 * theta2) * (row_sums[:, None] * Z - product[:, :-1])
    d_log_kernel = np.array([row_sums.sum(), 0.5 * float(np.vdot(Z, dZ)), d_excess])
    return value, dZ, d_log_kernel


def _smooth_kernel(Z: FloatArray, log_theta1: float, theta2: float) -> FloatArray:
    """K without its noise, (n, n), in Fortran's order."""
    half = -0.5 * theta2 * np.einsum("nq,nq->n", Z, Z)
    ones = np.ones(len(Z))
    # log θ1 - θ2/2 (|z_i|² + |z_j|² - 2 z_i z_j) in one product.
    left = np.column_stack([Z, half + log_theta1, ones])
    right = np.column_stack([theta2 * Z, ones, half])
    K: FloatArray = (right @ left.T).T
    np.fill_diagonal(K, log_theta1)  # rounding must not make it anything else
    return np.exp(K, out=K)
