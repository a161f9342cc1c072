"""A trained Gaussian process and its predictions, Eqs. (16) to (18), with derivatives.

The formulas hold for NumPy's arrays and for torch's tensors alike: a predictor that was moved to a
device (`Predictor.on`) holds tensors wherever arrays are written here.
"""

from __future__ import annotations

import sys
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.memory import FLOAT, require_memory
from facert.models.gp.jitter import whitener
from facert.models.kernels import Kernel

if TYPE_CHECKING:  # importing it takes seconds: not for those that stay on the CPU
    import torch


def namespace(array: FloatArray) -> Any:
    """The module of an array's functions: NumPy, or torch for a tensor."""
    return np if isinstance(array, np.ndarray) else sys.modules["torch"]


@dataclass(frozen=True)
class PosteriorPoint:
    """Mean and variance at B positions, with the terms that their derivatives need."""

    mean: FloatArray  # (B, D): μ, Eq. (16) or (18).
    variance: FloatArray  # (B,): σ², Eq. (17), the same for every column of the observations.
    offsets: FloatArray  # (B, q, N): z - z_i for every position that predictions are made from
    squared: FloatArray  # (B, N): |z - z_i|²
    k: FloatArray  # (B, N): k(z), the kernel against these positions
    whitened: FloatArray  # (B, N): T k; for an exact process T = L⁻¹, where L Lᵀ = K


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
        self.device: torch.device | None = None
        # [Tᵀ | α]: one product with k gives variance and mean. |T k|² keeps far more digits
        # than kᵀK⁻¹k, which matters where the noise is small against θ1.
        self.stacked: FloatArray = np.ascontiguousarray(np.hstack([whitener.T, alpha]))
        self.whitener = np.ascontiguousarray(whitener)
        self.Z_T = np.ascontiguousarray(Z.T)
        self.identity, self.zero = np.eye(len(self.Z_T)), np.zeros(1)

    def on(self, device: torch.device) -> Self:
        """A copy on a torch device that takes tensors, see `there`, and returns them."""
        moved = copy(self)
        moved.device = device
        for name in ("Z", "stacked", "whitener", "Z_T", "identity", "zero"):
            setattr(moved, name, moved.there(getattr(self, name)))
        return moved

    def there(self, array: FloatArray) -> FloatArray:
        """An array as this predictor takes it: a tensor on its device, if it has one."""
        if self.device is None:
            return array
        tensor = sys.modules["torch"].from_numpy(np.ascontiguousarray(array)).to(self.device)
        return cast(FloatArray, tensor)

    def here(self, array: FloatArray) -> FloatArray:
        """Convert an array of this predictor back to NumPy: the inverse of `there`."""
        return array if self.device is None else cast("torch.Tensor", array).cpu().numpy()

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
        n, xp = len(self.Z), namespace(z)
        offsets = z[:, :, None] - self.Z_T
        squared = xp.einsum("bqn,bqn->bn", offsets, offsets)
        k = self.kernel.value(squared)
        product = k @ self.stacked
        whitened, mean = product[:, :n], product[:, n:]  # Eq. (16) or (18)
        # Eq. (17). Rounding can take the difference below the noise, which is its least value.
        explained = xp.einsum("bn,bn->b", whitened, whitened)
        variance = self.kernel.noise + xp.maximum(self.kernel.variance - explained, self.zero)
        return PosteriorPoint(mean, variance, offsets, squared, k, whitened)

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
            ∂k_i/∂z = 2 k'_i (z - z_i).
        H : array, shape (B, q, N)
            G Tᵀ.
        J : array, shape (B, q, D)
            ∂μ/∂z.
        """
        n = len(self.Z)
        G = self._kernel_jacobian(at)
        batch, q, _ = G.shape
        place = None if out is None else out[: batch * q]
        product = namespace(G).matmul(G.reshape(-1, n), self.stacked, out=place)
        product = product.reshape(batch, q, -1)
        return G, product[:, :, :n], product[:, :, n:]

    def mean_jacobian(self, at: PosteriorPoint) -> FloatArray:
        """∂μ/∂z alone, J of `jacobians`, (B, q, D)."""
        G = self._kernel_jacobian(at)
        batch, q, n = G.shape
        J: FloatArray = (G.reshape(-1, n) @ self.alpha).reshape(batch, q, -1)
        return J

    def _kernel_jacobian(self, at: PosteriorPoint) -> FloatArray:
        """∂k/∂z, G of `jacobians`, (B, q, N)."""
        slopes: FloatArray = at.k * (2.0 * self.kernel.relative_slope(at.squared))
        return at.offsets * slopes[:, None, :]


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
        require_memory(4 * FLOAT * len(Z) ** 2, f"a kernel of {len(Z)} points", "Train on fewer.")
        L_inverse = whitener(kernel.gram(Z))
        super().__init__(Z, L_inverse, L_inverse.T @ (L_inverse @ X), kernel)
