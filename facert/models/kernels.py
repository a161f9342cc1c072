"""The kernels, Eq. (3) of Bouaziz and Pauly (2014), with their derivatives by squared distance.

    K_ij = k(s_ij) + θ3⁻¹ δ_ij,      s_ij = |z_i - z_j|²,      k(s) = θ1 φ(θ2 s),

where the paper's φ(u) = exp(-u/2). Whatever needs a kernel needs no more of it than k and its
derivatives k' = dk/ds and k'' = d²k/ds²:

    ∂k/∂z      = 2 k' (z - z_i),
    ∂²k/∂z²    = 2 k' I + 4 k'' (z - z_i)(z - z_i)ᵀ,
    ∂k/∂log θ1 = k,      ∂k/∂log θ2 = k' s.

To add a kernel, write a class with these three functions and name it in `KERNELS`.

The noise variance θ3⁻¹ has a floor, a prior on the noise of the observations: without one the
likelihood of a noise-free capture drives it to zero, σ_p² of Eq. (17) vanishes at the training
latents, and source mapping is pulled onto them.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.text import did_you_mean
from facert.errors import InputError

if TYPE_CHECKING:  # importing it takes seconds, and most methods do without
    from torch import Tensor

INITIAL_THETA = (1.0, 1.0, 100.0)  # the paper's {θ1, θ2, θ3}
LEAST_EXCESS = 1e-3  # noise above the floor where a search begins, relative to the floor

Array = TypeVar("Array", FloatArray, "Tensor")


@dataclass(frozen=True)
class Kernel(ABC):
    """A kernel with fixed parameters.

    Its functions take squared distances as arrays or tensors of any shape. Rounding may have taken
    those of points that agree below zero.
    """

    variance: float  # θ1
    inverse_width: float  # θ2, one over the squared length-scale
    noise: float  # θ3⁻¹, the noise variance

    @abstractmethod
    def value(self, squared: Array) -> Array:
        """k(s), without the noise."""

    @abstractmethod
    def relative_slope(self, squared: Array) -> Array | float:
        """k'/k; a float where it is the same everywhere."""

    @abstractmethod
    def relative_curvature(self, squared: Array) -> Array | float:
        """k''/k; a float where it is the same everywhere."""

    @classmethod
    def from_log(cls, log_kernel: FloatArray, noise_floor: float) -> Self:
        """Kernel from (log θ1, log θ2, log of the noise above the floor), shape (3,)."""
        with np.errstate(over="ignore"):  # the factorisation refuses what is infinite
            variance, inverse_width, excess = np.exp(log_kernel).tolist()
        return cls(variance, inverse_width, excess + noise_floor)

    def to_log(self, noise_floor: float) -> FloatArray:
        """Log parameters (3,): the inverse of `from_log`.

        Noise at the floor is taken to be a little above, or no gradient would lead away from it.
        """
        excess = max(self.noise - noise_floor, LEAST_EXCESS * noise_floor)
        return np.log([self.variance, self.inverse_width, excess])

    @property
    def theta(self) -> tuple[float, float, float]:
        """(θ1, θ2, θ3) as the paper writes them."""
        return self.variance, self.inverse_width, 1.0 / self.noise

    def cross(self, Z: FloatArray, Z_train: FloatArray) -> FloatArray:
        """The kernel without noise between two sets, (n, q) and (N, q), giving (n, N)."""
        squared = np.sum(Z * Z, axis=1)[:, None] + np.sum(Z_train * Z_train, axis=1)
        squared -= 2.0 * (Z @ Z_train.T)
        return self.value(squared)

    def prior_variance(self, Z: FloatArray) -> FloatArray:
        """The kernel without noise of each row with itself, (n,)."""
        return np.full(len(Z), self.variance)

    def gram(self, Z: FloatArray) -> FloatArray:
        """The training matrix K, (N, N), noise included."""
        K = self.cross(Z, Z)
        K[np.diag_indices_from(K)] = self.prior_variance(Z) + self.noise
        return K


def squared_exponential(squared: Array, inverse_width: Any) -> Array:
    """exp(-θ2/2 s), Eq. (3) with θ1 = 1; θ2 is a number, or an array that broadcasts."""
    k: Array = _exp(squared * (-0.5 * inverse_width))
    return k


@dataclass(frozen=True)
class SquaredExponential(Kernel):
    """The paper's kernel: k(s) = θ1 exp(-θ2/2 s)."""

    def value(self, squared: Array) -> Array:
        """k(s)."""
        k = squared_exponential(squared, self.inverse_width)
        k *= self.variance
        return k

    def relative_slope(self, squared: Array) -> float:  # noqa: ARG002  the same everywhere
        """k'/k = -θ2/2."""
        return -0.5 * self.inverse_width

    def relative_curvature(self, squared: Array) -> float:  # noqa: ARG002
        """k''/k = θ2²/4."""
        return 0.25 * self.inverse_width**2


@dataclass(frozen=True)
class Matern52(Kernel):
    """The Matérn kernel of a process that is twice differentiable (Rasmussen and Williams, 4.17).

    k(s) = θ1 p(a) exp(-a), where a = √(5 θ2 s) and p(a) = 1 + a + a²/3.
    """

    def value(self, squared: Array) -> Array:
        """k(s)."""
        a, p = self._polynomial(squared)
        return p * _exp(-a) * self.variance

    def relative_slope(self, squared: Array) -> Array:
        """k'/k = -5/6 θ2 (1 + a)/p(a)."""
        a, p = self._polynomial(squared)
        return (a + 1.0) / p * (-5.0 / 6.0 * self.inverse_width)

    def relative_curvature(self, squared: Array) -> Array:
        """k''/k = 25/12 θ2²/p(a)."""
        _, p = self._polynomial(squared)
        return 25.0 / 12.0 * self.inverse_width**2 / p

    def _polynomial(self, squared: Array) -> tuple[Array, Array]:
        a = squared.clip(0.0) ** 0.5 * math.sqrt(5.0 * self.inverse_width)
        return a, a * (a / 3.0 + 1.0) + 1.0


@dataclass(frozen=True)
class RegressionKernel(SquaredExponential):
    """The squared exponential with a linear term: k(x, x') = θ1 exp(-θ2/2 |x - x'|²) + θ4 xᵀx'."""

    linear: float = 0.0  # θ4

    def cross(self, Z: FloatArray, Z_train: FloatArray) -> FloatArray:
        """The kernel without noise between two sets, (n, q) and (N, q), giving (n, N)."""
        return super().cross(Z, Z_train) + self.linear * (Z @ Z_train.T)

    def prior_variance(self, Z: FloatArray) -> FloatArray:
        """The kernel without noise of each row with itself, (n,)."""
        squares: FloatArray = np.einsum("nq,nq->n", Z, Z)
        return super().prior_variance(Z) + self.linear * squares


KERNELS: Mapping[str, type[Kernel]] = MappingProxyType(
    {"squared-exponential": SquaredExponential, "matern-5/2": Matern52}
)


def kernel_class(name: str, field: str) -> type[Kernel]:
    """The kernel of that name; raises InputError, which names the field, when there is none."""
    if name not in KERNELS:
        expected = "one of " + ", ".join(KERNELS)
        raise InputError(field, expected, repr(name), did_you_mean(name, KERNELS))
    return KERNELS[name]


def initial_log_kernel() -> FloatArray:
    """Log parameters (3,) of the paper's initial {1, 1, 100}, the noise above the floor."""
    theta1, theta2, theta3 = INITIAL_THETA
    return np.log([theta1, theta2, 1.0 / theta3])


def _exp(x: Array) -> Array:
    """The exponential, computed in place."""
    if isinstance(x, np.ndarray):
        np.exp(x, out=x)
    else:
        x.exp_()
    return x
