"""A trained Gaussian process and its predictions, Eqs. (16) to (18), with derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from facert.data import FloatArray
from facert.gp.cholesky import cholesky
from facert.gp.kernel import Kernel


@dataclass(frozen=True)
class PosteriorPoint:
    """Mean and variance at B positions, with what their derivatives need.

    Parameters
    ----------
    mean : array, shape (B, D)
        μ, Eq. (16) or (18).
    variance : array, shape (B,)
        σ², Eq. (17), the same for every column of the observations.
    offsets : array, shape (B, N, q)
        z - z_i for every training position.
    k : array, shape (B, N)
        k(z), the kernel against the training positions.
    whitened : array, shape (B, N)
        L⁻¹ k, where L Lᵀ = K.
    """

    mean: FloatArray
    variance: FloatArray
    offsets: FloatArray
    k: FloatArray
    whitened: FloatArray


class Posterior:
    """The process given its training data, D columns of observations that share one kernel.

    Parameters
    ----------
    Z : array, shape (N, q)
        Training positions.
    X : array, shape (N, D)
        Observations, with mean zero.
    kernel : Kernel
        Fixed parameters.
    """

    def __init__(self, Z: FloatArray, X: FloatArray, kernel: Kernel) -> None:
        self.Z, self.X, self.kernel = Z, X, kernel
        L = cholesky(torch.from_numpy(kernel.gram(Z)))
        identity = torch.eye(len(Z), dtype=torch.float64)
        L_inverse: FloatArray = torch.linalg.solve_triangular(L, identity, upper=False).numpy()
        alpha = L_inverse.T @ (L_inverse @ X)
        # [L⁻ᵀ | K⁻¹ X]: one product with k gives variance and mean. |L⁻¹k|² keeps far more digits
        # than kᵀK⁻¹k, which matters where the noise is small against θ1.
        self.stacked: FloatArray = np.ascontiguousarray(np.hstack([L_inverse.T, alpha]))
        self._L_inverse = np.ascontiguousarray(L_inverse)

    @property
    def alpha(self) -> FloatArray:
        """K⁻¹ X, (N, D)."""
        return self.stacked[:, len(self.Z) :]

    def predict(self, z: FloatArray) -> PosteriorPoint:
        """Mean and variance of a new observation at z (B, q), noise included."""
        n = len(self.Z)
        offsets = z[:, None, :] - self.Z
        squared = np.einsum("bnq,bnq->bn", offsets, offsets)
        k = self.kernel.variance * np.exp(-0.5 * self.kernel.inverse_width * squared)
        product = k @ self.stacked
        whitened, mean = product[:, :n], product[:, n:]
        # Rounding can take the difference below the noise, which is its least value.
        explained = np.einsum("bn,bn->b", whitened, whitened)
        variance = self.kernel.noise + np.maximum(self.kernel.variance - explained, 0.0)
        return PosteriorPoint(mean, variance, offsets, k, whitened)

    def solve(self, at: PosteriorPoint) -> FloatArray:
        """K⁻¹ k, (B, N)."""
        return at.whitened @ self._L_inverse

    def jacobians(self, at: PosteriorPoint) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Derivatives of k, of L⁻¹ k and of the mean with respect to z.

        Returns
        -------
        G : array, shape (B, q, N)
            ∂k_i/∂z = -θ2 (z - z_i) k_i.
        H : array, shape (B, q, N)
            G L⁻ᵀ.
        J : array, shape (B, q, D)
            ∂μ/∂z.
        """
        n = len(self.Z)
        G = (at.offsets * (-self.kernel.inverse_width * at.k)[:, :, None]).transpose(0, 2, 1)
        G = np.ascontiguousarray(G)
        batch, q, _ = G.shape
        product = (G.reshape(-1, n) @ self.stacked).reshape(batch, q, -1)
        return G, product[:, :, :n], product[:, :, n:]
