"""Gaussian processes on features of frames, which several methods are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.linalg.lapack import dpotrs

from facert.data.array_group import DAMAGED
from facert.data.arrays import FloatArray
from facert.data.memory import FLOAT, require_memory
from facert.errors import InputError
from facert.methods.base import Labelled
from facert.methods.regression import MOST_KERNELS, Map, Variance
from facert.methods.waiting_frames import WaitingFrames
from facert.models.gp.hyperparameters import maximise_likelihood
from facert.models.gp.jitter import inverted, lower_factor
from facert.models.kernels import RegressionKernel, squared_exponential
from facert.models.loo import leave_one_out_errors
from facert.models.threads import SMALL
from facert.models.whitening import whitening

POWER = 0.5  # half-whitening


@dataclass(frozen=True, eq=False)
class ProcessMap(Map):
    """A Gaussian process given its training data."""

    # (n, d_x) and (n, d_y): Training frames and poses, with mean zero
    X: Annotated[FloatArray, "nx"]
    Y: Annotated[FloatArray, "ny"]
    # (4,): θ1, θ2, θ3 and θ4 of `facert.models.gp.hyperparameters`; θ1 or θ4 may be 0
    theta: Annotated[FloatArray, "4"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.theta < 0).any() or not self.theta[1:3].all():
            raise InputError("theta", "positive numbers", f"{self.theta}", DAMAGED)

    def __call__(self, X: FloatArray) -> tuple[FloatArray, Variance]:
        """Mean of a new observation at each frame, and its variance, noise included."""
        return self._on_the_source(X)

    @cached_property
    def kernel(self) -> RegressionKernel:
        """The kernel that all columns share."""
        theta1, theta2, theta3, theta4 = self.theta.tolist()
        return RegressionKernel(theta1, theta2, 1.0 / theta3, theta4)

    @cached_property
    def whitening(self) -> FloatArray:
        """L⁻ᵀ, where L Lᵀ = K, (n, n)."""
        L = self._factor
        del vars(self)["_factor"]  # two such matrices are enough
        return np.ascontiguousarray(np.tril(inverted(L)).T)

    @cached_property
    def alpha(self) -> FloatArray:
        """K⁻¹ Y, (n, d_y)."""
        if len(self.X) <= SMALL:
            return np.asarray(self.whitening @ (self.whitening.T @ self.Y))
        # An inverse of many takes seconds, which only the variance is worth.
        return np.asarray(dpotrs(self._factor, self.Y, lower=1)[0])

    @cached_property
    def _factor(self) -> FloatArray:
        """L, (n, n); its upper triangle means nothing."""
        n = len(self.X)
        require_memory(4 * FLOAT * n**2, f"a kernel of {n} poses", "Train on fewer.")
        return lower_factor(self.kernel.gram(self.X))

    @property
    def leave_one_out_errors(self) -> FloatArray:
        """Each pose less its prediction by the process without it, (n, d_y)."""
        return leave_one_out_errors(self.alpha, np.sum(self.whitening**2, axis=1))

    @cached_property
    def _on_the_source(self) -> FeatureProcess:
        d_x, d_y = self.X.shape[1], self.Y.shape[1]
        return FeatureProcess(np.zeros(d_x), np.eye(d_x), np.zeros(d_y), self)


@dataclass(frozen=True, eq=False)
class FeatureProcess(Map):
    """A Gaussian process with a linear term, on features of the source."""

    centre: Annotated[FloatArray, "x"]  # (d_x,): Mean of all frames
    # (d_x, d_x): Of the features, see `facert.models.whitening.whitening`
    basis: Annotated[FloatArray, "xx"]
    mean: Annotated[FloatArray, "y"]  # (d_y,): The pose expected before any label is seen
    process: ProcessMap  # From features to poses less their mean

    @classmethod
    def learn(cls, labelled: Labelled, basis: Basis, mean: FloatArray) -> FeatureProcess:
        """The process of maximum likelihood given labelled frames."""
        features, targets = basis.features(labelled.X), labelled.Y - mean
        kernel = maximise_likelihood(features, targets).kernel
        theta = np.array([*kernel.theta, kernel.linear])
        return cls(basis.centre, basis.matrix, mean, ProcessMap(features, targets, theta))

    def __call__(self, X: FloatArray) -> tuple[FloatArray, Variance]:
        """Poses of frames X (T, d_x), (T, d_y), and their variance, the same for all controls."""
        poses, variances = self._bank(X)
        return poses[0], lambda: np.repeat(variances()[0, :, None], len(self.mean), axis=1)

    @cached_property
    def _bank(self) -> ProcessBank:
        return ProcessBank([self])


@dataclass(frozen=True, eq=False)
class Basis:
    """Features of frames: φ(x) = (x - centre) matrix."""

    centre: FloatArray
    matrix: FloatArray

    @classmethod
    def plain(cls, frames: FloatArray) -> Basis:
        """The source as it is, noise and all, less the mean of frames (n, d_x)."""
        return cls(frames.mean(axis=0), np.eye(frames.shape[1]))

    @classmethod
    def half_whitened(cls, frames: FloatArray) -> Basis:
        """Features whose proportions are half-way to equal, learned from frames (n, d_x)."""
        return cls(frames.mean(axis=0), whitening(frames, POWER))

    def features(self, X: FloatArray) -> FloatArray:
        """Features of frames X (T, d_x), (T, d_x)."""
        return (X - self.centre) @ self.matrix


class ProcessBank:
    """Processes on the same n labels, evaluated together.

    Processes on the same features share products and distances, and all poses are one product with
    their α. So a single frame takes few operations; many are taken in parts, for little memory.

    Parameters
    ----------
    processes : sequence of FeatureProcess, length p
    """

    def __init__(self, processes: Sequence[FeatureProcess]) -> None:
        self._features: list[_Features] = []
        self._of = np.array([self._place(process) for process in processes])
        self._norms = np.stack([features.norms for features in self._features])[:, None]
        theta = np.array([process.process.theta for process in processes])
        self._theta1, self._theta2, theta3, theta4 = theta.T[:, :, None, None]
        self._noise, self._half_theta4 = 1.0 / theta3[:, 0], 0.5 * theta4
        self._alpha = np.stack([process.process.alpha for process in processes])
        self._means = np.stack([process.mean for process in processes])[:, None]
        self._maps = [process.process for process in processes]
        self._waiting = WaitingFrames()
        self._rows = max(1, MOST_KERNELS // (len(processes) * self._norms.shape[2]))

    def __call__(self, X: FloatArray) -> tuple[FloatArray, Variance]:
        """Poses of frames X (T, d_x), (p, T, d_y), and their variances, noise included, (p, T)."""
        if len(X) <= self._rows:
            return self._at_once(X)
        parts = [X[first : first + self._rows] for first in range(0, len(X), self._rows)]
        poses = np.concatenate([self._at_once(part)[0] for part in parts], axis=1)
        # Keeping the kernels until somebody asks would take what the parts are there to save.
        return poses, lambda: np.concatenate([self._at_once(part)[1]() for part in parts], axis=1)

    def _at_once(self, X: FloatArray) -> tuple[FloatArray, Variance]:
        products = np.empty((len(self._features), len(X), self._norms.shape[2]))  # 2 φᵀφ_i
        squares = np.empty((len(self._features), len(X), 1))  # |φ|²
        for row, features in enumerate(self._features):
            phi = features(X)
            np.matmul(phi, features.doubled, out=products[row])
            squares[row, :, 0] = np.vecdot(phi, phi)
        distances = self._norms + squares
        distances -= products
        np.maximum(distances, 0.0, out=distances)
        k = squared_exponential(distances.take(self._of, axis=0), self._theta2)
        k *= self._theta1
        k += self._half_theta4 * products.take(self._of, axis=0)
        poses = np.matmul(k, self._alpha)
        poses += self._means
        if len(X) == 1 and k.shape[2] > SMALL:
            return poses, self._waiting.add(k, squares, self._variances)
        return poses, lambda: self._variances(k, squares)

    def _variances(self, k: FloatArray, squares: FloatArray) -> FloatArray:
        """Variances (p, T), from the kernels (p, T, n) and |φ|² of every feature (f, T, 1)."""
        whitened = [np.matmul(one, map_.whitening) for one, map_ in zip(k, self._maps, strict=True)]
        explained = np.stack([np.vecdot(one, one) for one in whitened])
        prior = self._theta1 + 2.0 * self._half_theta4 * squares[self._of]
        # Rounding can take the difference below the noise, which is its least value.
        return np.asarray(self._noise + np.maximum(prior[:, :, 0] - explained, 0.0))

    def _place(self, process: FeatureProcess) -> int:
        """Index in the list of a process's features, appended if they are new."""
        for place, features in enumerate(self._features):
            if features.are_those_of(process):
                return place
        self._features.append(_Features(process))
        return len(self._features) - 1


class _Features:
    """Computes the features of frames that are not always 0, and holds the labels'."""

    def __init__(self, process: FeatureProcess) -> None:
        self._process = process
        kept = process.basis.any(axis=0)
        self.doubled = np.ascontiguousarray(2.0 * process.process.X[:, kept]).T
        self.norms = np.sum(process.process.X**2, axis=1)
        is_plain = np.array_equal(process.basis, np.eye(len(process.basis)))
        self._centre = process.centre
        self._basis = None if is_plain else np.ascontiguousarray(process.basis[:, kept])

    def are_those_of(self, other: FeatureProcess) -> bool:
        own = self._process
        return (
            np.array_equal(own.centre, other.centre)
            and np.array_equal(own.basis, other.basis)
            and np.array_equal(own.process.X, other.process.X)
        )

    def __call__(self, X: FloatArray) -> FloatArray:
        centred = X - self._centre
        return centred if self._basis is None else centred @ self._basis
