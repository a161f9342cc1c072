"""The squared exponential kernel with noise, Eq. (3) of Bouaziz and Pauly (2014).

    k(z_i, z_j) = θ1 exp(-θ2/2 |z_i - z_j|²) + θ3⁻¹ δ_ij

The noise variance θ3⁻¹ has a floor, a prior on the noise of the observations: without one the
likelihood of a noise-free capture drives it to zero, σ_p² of Eq. (17) vanishes at the training
latents, and source mapping is pulled onto them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray

INITIAL_THETA = (1.0, 1.0, 100.0)  # the paper's {θ1, θ2, θ3}
LEAST_EXCESS = 1e-3  # noise above the floor where a search begins, relative to the floor


@dataclass(frozen=True)
class Kernel:
    """A kernel with fixed parameters.

    Parameters
    ----------
    variance : float
        θ1.
    inverse_width : float
        θ2, one over the squared length-scale.
    noise : float
        θ3⁻¹, the noise variance.
    """

    variance: float
    inverse_width: float
    noise: float

    @classmethod
    def from_log(cls, log_kernel: FloatArray, noise_floor: float) -> Kernel:
        """From (log θ1, log θ2, log of the noise above the floor), shape (3,)."""
        variance, inverse_width, excess = np.exp(log_kernel)
        return cls(float(variance), float(inverse_width), float(excess) + noise_floor)

    def to_log(self, noise_floor: float) -> FloatArray:
        """The inverse of `from_log`.

        Noise at the floor is taken to be a little above, or no gradient would lead away from it.
        """
        excess = max(self.noise - noise_floor, LEAST_EXCESS * noise_floor)
        return np.log([self.variance, self.inverse_width, excess])

    @property
    def theta(self) -> tuple[float, float, float]:
        """(θ1, θ2, θ3) as the paper writes them."""
        return self.variance, self.inverse_width, 1.0 / self.noise

    def cross(self, Z: FloatArray, Z_train: FloatArray) -> FloatArray:
        """θ1 exp(-θ2/2 |z_i - z_j|²) between two sets, (n, q) and (N, q), giving (n, N)."""
        squared = (
            np.sum(Z * Z, axis=1)[:, None]
            + np.sum(Z_train * Z_train, axis=1)
            - 2.0 * (Z @ Z_train.T)
        )
        k: FloatArray = self.variance * np.exp(-0.5 * self.inverse_width * np.maximum(squared, 0.0))
        return k

    def gram(self, Z: FloatArray) -> FloatArray:
        """The training matrix K, (N, N), noise included."""
        K = self.cross(Z, Z)
        K[np.diag_indices_from(K)] = self.variance + self.noise
        return K


def initial_log_kernel() -> FloatArray:
    """Log parameters that give the paper's initial {1, 1, 100}, with the floor beside it."""
    theta1, theta2, theta3 = INITIAL_THETA
    return np.log([theta1, theta2, 1.0 / theta3])
