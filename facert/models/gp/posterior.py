"""A trained Gaussian process and its predictions, Eqs. (16) to (18), with derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.gp.jitter import whitener
from facert.models.kernels import Kernel


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
        z - z_i for every position that predictions are made from.
    k : array, shape (B, N)
        k(z), the kernel against these positions.
    whitened : array, shape (B, N)
        T k; for an exact process T = L⁻¹, where L Lᵀ = K.
    """

    mean: FloatArray
    variance: FloatArray
    offsets: FloatArray
    k: FloatArray
    whitened: FloatArray


class Predictor:
    """A process whose mean is kᵀα and whose variance is θ1 + θ3⁻¹ - |T k|².

    Parameters
    ----------
    Z : array, shape (N, q)
        Positions that k is taken against: of the training data, or inducing ones.
    whitener : array, shape (N, N)
        T. For an exact process TᵀT = K⁻¹; for a sparse one see `facert.models.gp.sparse_posterior`.
    alpha : array, shape (N, D)
        α.
    kernel : Kernel
        Fixed parameters.
    """

    def __init__(
        self, Z: FloatArray, whitener: FloatArray, alpha: FloatArray, kernel: Kernel
    ) -> None:
        self.Z, self.kernel = Z, kernel
        # [Tᵀ | α]: one product with k gives variance and mean. |T k|² keeps far more digits
        # than kᵀK⁻¹k, which matters where the noise is small against θ1.
        self.stacked: FloatArray = np.ascontiguousarray(np.hstack([whitener.T, alpha]))
        self.whitener = np.ascontiguousarray(whitener)

    @property
    def alpha(self) -> FloatArray:
        """α, K⁻¹ X of an exact process, (N, D)."""
        return self.stacked[:, len(self.Z) :]

    @property
    def columns(self) -> int:
        """D, the columns of the observations."""
        return int(self.stacked.shape[1] - len(self.Z))

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
        """TᵀT k, K⁻¹ k of an exact process, (B, N)."""
        return at.whitened @ self.whitener

    def jacobians(
        self, at: PosteriorPoint, out: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Derivatives of k, of T k and of the mean with respect to z.

        Parameters
        ----------
        at : PosteriorPoint
            B positions.
        out : array, shape (B q or more, N + D), optional
            Where H and J are kept: fresh memory of that size costs as much as the products.

        Returns
        -------
        G : array, shape (B, q, N)
            ∂k_i/∂z = -θ2 (z - z_i) k_i.
        H : array, shape (B, q, N)
            G Tᵀ.
        J : array, shape (B, q, D)
            ∂μ/∂z.
        """
        n = len(self.Z)
        G = self._kernel_jacobian(at)
        batch, q, _ = G.shape
        place = None if out is None else out[: batch * q]
        product = np.matmul(G.reshape(-1, n), self.stacked, out=place).reshape(batch, q, -1)
        return G, product[:, :, :n], product[:, :, n:]

    def mean_jacobian(self, at: PosteriorPoint) -> FloatArray:
        """∂μ/∂z alone, J of `jacobians`, (B, q, D)."""
        G = self._kernel_jacobian(at)
        batch, q, n = G.shape
        J: FloatArray = (G.reshape(-1, n) @ self.alpha).reshape(batch, q, -1)
        return J

    def _kernel_jacobian(self, at: PosteriorPoint) -> FloatArray:
        """∂k/∂z, G of `jacobians`, (B, q, N)."""
        weights = -self.kernel.inverse_width * at.k
        return np.multiply(at.offsets.transpose(0, 2, 1), weights[:, None, :], order="C")


class Posterior(Predictor):
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
        self.X = X
        L_inverse = whitener(kernel.gram(Z))
        super().__init__(Z, L_inverse, L_inverse.T @ (L_inverse @ X), kernel)
