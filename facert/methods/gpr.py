"""Gaussian process regression: `gpr` with the paper's kernel, `gpr-linear` with a linear term.

The process has mean zero in normalised units: before it has seen a label it expects the mean of all
poses that are known, animation included.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from facert.data.array_group import DAMAGED
from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.methods.regression import Map, SupervisedRegression
from facert.models.gp.hyperparameters import (
    LINEAR_BOUNDS,
    NO_LINEAR_TERM,
    maximise_likelihood,
)
from facert.models.gp.jitter import whitener
from facert.models.kernels import RegressionKernel


@dataclass(frozen=True, eq=False)
class ProcessMap(Map):
    """A Gaussian process given its training data.

    Parameters
    ----------
    X, Y : arrays, shapes (n, d_x) and (n, d_y)
        Training frames and poses, with mean zero.
    theta : array, shape (4,)
        θ1, θ2, θ3 and θ4 of `facert.models.gp.hyperparameters`; θ1 or θ4 may be 0.
    """

    axes: ClassVar[Mapping[str, str]] = {"X": "nx", "Y": "ny", "theta": "4"}

    X: FloatArray
    Y: FloatArray
    theta: FloatArray

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.theta < 0).any() or not self.theta[1:3].all():
            raise InputError("theta", "positive numbers", f"{self.theta}", DAMAGED)

    @cached_property
    def kernel(self) -> RegressionKernel:
        """Of all columns."""
        theta1, theta2, theta3, theta4 = self.theta.tolist()
        return RegressionKernel(theta1, theta2, 1.0 / theta3, theta4)

    def __call__(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation of a new observation at each frame, noise included."""
        n = len(self.X)
        product = self.kernel.cross(X, self.X) @ self._stacked
        whitened, mean = product[:, :n], product[:, n:]
        explained = np.einsum("tn,tn->t", whitened, whitened)
        # Rounding can take the difference below the noise, which is its least value.
        spread = np.maximum(self.kernel.prior_variance(X) - explained, 0.0)
        std = np.sqrt(self.kernel.noise + spread)
        return mean, np.repeat(std[:, None], mean.shape[1], axis=1)

    @property
    def alpha(self) -> FloatArray:
        """K⁻¹ Y, (n, d_y)."""
        return self._stacked[:, len(self.X) :]

    @property
    def whitening(self) -> FloatArray:
        """L⁻ᵀ, where L Lᵀ = K, (n, n)."""
        return self._stacked[:, : len(self.X)]

    @property
    def left_out_errors(self) -> FloatArray:
        """Each pose less what would be said of it if it alone were left out, (n, d_y).

        (K⁻¹Y)_i / (K⁻¹)_ii: Rasmussen and Williams (2006), Eq. (5.12).
        """
        diagonal = np.einsum("nm,nm->n", self.whitening, self.whitening)
        errors: FloatArray = self.alpha / diagonal[:, None]
        return errors

    @cached_property
    def _stacked(self) -> FloatArray:
        """[L⁻ᵀ | K⁻¹ Y], (n, n + d_y): one product with k(x) gives variance and mean."""
        L_inverse = whitener(self.kernel.gram(self.X))
        return np.ascontiguousarray(np.hstack([L_inverse.T, L_inverse.T @ (L_inverse @ self.Y)]))


class GPR(SupervisedRegression):
    """Gaussian process regression with the squared exponential, the paper's baseline."""

    map_type = ProcessMap
    linear_bounds = NO_LINEAR_TERM

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[ProcessMap, dict[str, float]]:
        found = maximise_likelihood(X, Y, self.linear_bounds)
        theta = np.array([*found.kernel.theta, found.kernel.linear])
        figures = {f"theta{index}": float(value) for index, value in enumerate(theta, start=1)}
        return ProcessMap(X, Y, theta), {"log likelihood": found.value, **figures}


class LinearGPR(GPR):
    """Gaussian process regression with the squared exponential and a linear term."""

    linear_bounds = LINEAR_BOUNDS
