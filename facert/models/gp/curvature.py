"""The second derivatives of the exact likelihood, in closed form.

With the letters of `facert.models.gp.likelihood`, P = K⁻¹, B = A Aᵀ and C = B - d P/2, the second
differential of -log P(X|Z) in directions ∂ and ∂' is

    tr(G ∂∂'K) + tr(P ∂K C ∂'K).

A latent coordinate moves one row and one column of K alone: ∂K/∂z_ia = e_i g_iaᵀ + g_ia e_iᵀ,
where g_ia holds ∂k(z_i, z_m)/∂z_ia = 2 k' (z_i - z_m)_a. With all g_ia as the rows of J, the second
term of two coordinates is

    (J C)_ia,j (J P)_jb,i + (J P)_ia,j (J C)_jb,i + P_ij (J C Jᵀ)_ia,jb + C_ij (J P Jᵀ)_ia,jb,

and the first is the curvature of the kernel, 2 k' I + 4 k'' (z_i - z_j)(z_i - z_j)ᵀ, weighted by G.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.gp.jitter import whitener
from facert.models.kernels import Kernel


def likelihood_hessian(
    Z: FloatArray,
    log_kernel: FloatArray,
    F: FloatArray,
    columns: int,
    noise_floor: float,
    kernel: type[Kernel],
) -> FloatArray:
    """The Hessian of -log P(X|Z) in Z, row by row, and in the log-kernel parameters.

    Parameters are those of `facert.models.gp.likelihood.negative_log_likelihood`, as arrays.

    Returns
    -------
    array, shape (n q + 3, n q + 3)

    Raises
    ------
    NumericalError
        When the kernel matrix is not positive definite within the jitter ladder.
    """
    at = _Expansion.of(Z, kernel.from_log(log_kernel, noise_floor), F, columns)
    n, q = Z.shape
    hessian = np.empty((n * q + 3, n * q + 3))
    hessian[:-3, :-3] = _of_latents(at).reshape(n * q, n * q)
    dK = [at.k, at.k1 * at.squared, math.exp(log_kernel[2]) * np.eye(n)]
    hessian[-3:, :-3] = _mixed(at, dK)
    hessian[:-3, -3:] = hessian[-3:, :-3].T
    hessian[-3:, -3:] = _of_kernel(at, dK)
    return hessian


@dataclass(frozen=True, eq=False)
class _Expansion:
    """The kernel matrix and what the differentials are made of; matrices are (n, n)."""

    offsets: FloatArray  # (n, q, n): z_i - z_m
    squared: FloatArray
    # k and its derivatives by squared distance
    k: FloatArray
    k1: FloatArray
    k2: FloatArray
    # G, P and C
    G: FloatArray
    P: FloatArray
    C: FloatArray

    @classmethod
    def of(cls, Z: FloatArray, kernel: Kernel, F: FloatArray, columns: int) -> _Expansion:
        offsets = Z[:, :, None] - Z.T
        squared = np.einsum("iaj,iaj->ij", offsets, offsets)
        k = kernel.value(squared)
        T = whitener(k + kernel.noise * np.eye(len(Z)))
        P, whitened = T.T @ T, T @ F
        A = T.T @ whitened
        B = A @ A.T
        k1, k2 = k * kernel.relative_slope(squared), k * kernel.relative_curvature(squared)
        return cls(offsets, squared, k, k1, k2, 0.5 * (columns * P - B), P, B - (0.5 * columns) * P)


def _of_latents(at: _Expansion) -> FloatArray:
    """Second derivatives in two latent coordinates, (n, q, n, q)."""
    n, q, _ = at.offsets.shape
    J = (at.offsets * (2.0 * at.k1)[:, None, :]).reshape(n * q, n)
    JP, JC = J @ at.P, J @ at.C
    crossed = JC.reshape(n, q, n, 1) * JP.reshape(n, q, n).transpose(2, 0, 1)[:, None]
    flat = crossed.reshape(n * q, n * q)
    hessian = (flat + flat.T).reshape(n, q, n, q)
    hessian += (JC @ J.T).reshape(n, q, n, q) * at.P[:, None, :, None]
    hessian += (JP @ J.T).reshape(n, q, n, q) * at.C[:, None, :, None]

    slope, rows, axes = 4.0 * at.G * at.k1, np.arange(n), np.arange(q)
    np.fill_diagonal(slope, 0.0)
    curved = at.offsets * (8.0 * at.G * at.k2)[:, None, :]
    across = at.offsets.transpose(0, 2, 1)
    hessian -= curved[:, :, :, None] * across[:, None, :, :]
    hessian[:, axes, :, axes] -= slope
    hessian[rows, :, rows, :] += curved @ across  # a point moves against all others
    hessian[rows[:, None], axes, rows[:, None], axes] += slope.sum(axis=1)[:, None]
    return hessian


def _mixed(at: _Expansion, dK: list[FloatArray]) -> FloatArray:
    """Second derivatives in a parameter of the kernel and a latent coordinate, (3, n q)."""
    # ∂²K/∂log θ1∂s = k', ∂²K/∂log θ2∂s = k' + k'' s; the noise moves no other entry
    slopes = (at.k1, at.k1 + at.k2 * at.squared, 0.0 * at.k1)
    rows = []
    for D, slope in zip(dK, slopes, strict=True):
        M = at.P @ D @ at.C
        weight = 2.0 * at.k1 * (M + M.T) + 4.0 * at.G * slope
        rows.append(np.einsum("iaj,ij->ia", at.offsets, weight).ravel())
    return np.stack(rows)


def _of_kernel(at: _Expansion, dK: list[FloatArray]) -> FloatArray:
    """Second derivatives in two parameters of the kernel, (3, 3)."""
    by_P, by_C = np.stack([at.P @ D for D in dK]), np.stack([at.C @ D for D in dK])
    hessian: FloatArray = np.einsum("aij,bji->ab", by_P, by_C)
    of_width = at.k2 * at.squared**2 + dK[1]
    first, mixed, second, noise = (float(np.vdot(at.G, D)) for D in (dK[0], dK[1], of_width, dK[2]))
    hessian += np.array([[first, mixed, 0.0], [mixed, second, 0.0], [0.0, 0.0, noise]])
    return hessian
