"""`auto` and `ssgpr` for single frames: the formulas of their maps in as few operations as may be.

Processes that share their features share products and distances, and all processes are one product
with their α. What a blend gives no weight is left out; variances are told only when asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr

from facert.data.arrays import FloatArray
from facert.methods.frame_stream import Tell
from facert.models.factors.censoring import LOG_2PI

if TYPE_CHECKING:
    from facert.methods.blend import BlendMap
    from facert.methods.factors import FactorMap
    from facert.methods.ssgpr import FeatureProcess, ShrunkProcess

NO_LIMIT = 1e9  # standard deviations away: what it takes from a pose is 0 exactly


@dataclass(frozen=True, eq=False)
class Told:
    """What p processes say of one frame.

    Parameters
    ----------
    poses : array, shape (p, d_y)
    k : array, shape (p, n)
        Their kernels between the frame and the n labels.
    squares : array, shape (p,)
        |φ|² of the frame's features.
    """

    poses: FloatArray
    k: FloatArray
    squares: FloatArray


class _Features:
    """Features of a frame, and of the labels that they are compared with."""

    def __init__(self, process: FeatureProcess) -> None:
        self._process = process
        kept = process.basis.any(axis=0)
        self.centre, self.Z = process.centre, np.ascontiguousarray(process.process.X[:, kept])
        self.norms = np.sum(process.process.X**2, axis=1)
        is_plain = np.array_equal(process.basis, np.eye(len(process.basis)))
        self._basis = None if is_plain else np.ascontiguousarray(process.basis[:, kept])

    def are_those_of(self, other: FeatureProcess) -> bool:
        own = self._process
        return (
            np.array_equal(own.centre, other.centre)
            and np.array_equal(own.basis, other.basis)
            and np.array_equal(own.process.X, other.process.X)
        )

    def __call__(self, x: FloatArray) -> FloatArray:
        centred = x - self.centre
        return centred if self._basis is None else centred @ self._basis


class ProcessBank:
    """Processes on the same n labels, asked together.

    Parameters
    ----------
    processes : sequence of FeatureProcess, length p
    """

    def __init__(self, processes: Sequence[FeatureProcess]) -> None:
        self._features: list[_Features] = []
        self._of = np.array([self._place(process) for process in processes])
        self._norms = np.stack([features.norms for features in self._features])
        theta = np.array([process.process.theta for process in processes])
        self._theta1, theta2, theta3, self._theta4 = theta.T[:, :, None]
        self._minus_half_theta2, self._noise = -0.5 * theta2, 1.0 / theta3
        self._alpha = np.stack([process.process.alpha for process in processes])
        self._means = np.stack([process.mean for process in processes])
        self._whitening = np.stack([process.process.whitening for process in processes])

    def __call__(self, x: FloatArray) -> Told:
        """What they say of a complete frame (d_x,), their means included."""
        products = np.empty_like(self._norms)
        squares = np.empty((len(products), 1))
        for row, features in enumerate(self._features):
            phi = features(x)
            products[row] = features.Z @ phi
            squares[row] = phi @ phi
        distances = self._norms + squares
        distances -= 2.0 * products
        np.maximum(distances, 0.0, out=distances)
        k = distances[self._of]
        k *= self._minus_half_theta2
        np.exp(k, out=k)
        k *= self._theta1
        k += self._theta4 * products[self._of]
        poses = np.matmul(k[:, None], self._alpha)[:, 0]
        poses += self._means
        return Told(poses, k, squares)

    def variances(self, told: Told) -> FloatArray:
        """Of what was told, noise included, (p,)."""
        whitened = np.matmul(told.k[:, None], self._whitening)[:, 0]
        explained = np.einsum("pn,pn->p", whitened, whitened)
        prior = self._theta1 + self._theta4 * told.squares[self._of]
        spread = np.maximum(prior[:, 0] - explained, 0.0)
        return np.asarray(self._noise[:, 0] + spread)

    def _place(self, process: FeatureProcess) -> int:
        """Where its features are in the list, after they were put there if they are new."""
        for place, features in enumerate(self._features):
            if features.are_those_of(process):
                return place
        self._features.append(_Features(process))
        return len(self._features) - 1


class FactorFrame:
    """`FactorMap` for single frames, see `facert.models.factors.censoring.Limits.expected`.

    Parameters
    ----------
    factors : FactorMap
    """

    def __init__(self, factors: FactorMap) -> None:
        self._weights = factors.weights
        self._offset = factors.offset - factors.centre @ factors.weights
        # low - mean and mean - high are the same with other signs.
        self._signed_std = np.array([[1.0], [-1.0]]) * factors.spread
        unlimited = np.array([[-NO_LIMIT], [NO_LIMIT]]) * factors.spread
        self._limits = np.where(factors.censored > 0, factors.limits, unlimited)

    def __call__(self, x: FloatArray) -> FloatArray:
        """The pose (d_y,) of a complete frame (d_x,)."""
        free = x @ self._weights
        free += self._offset
        t = (self._limits - free) / self._signed_std
        taken = np.exp(-0.5 * (t * t + LOG_2PI))
        taken += t * ndtr(t)
        taken *= self._signed_std
        free += taken[0]
        free += taken[1]
        return free


class BlendFrame:
    """`BlendMap` for single frames.

    Parameters
    ----------
    blend : BlendMap
    """

    def __init__(self, blend: BlendMap) -> None:
        direct = [e for e in (0, 1) if blend.weights[e] > 0.0]
        processes = [(blend.plain, blend.whitened)[e] for e in direct]
        self._direct = len(direct)
        self._bank = ProcessBank([*processes, blend.residual])
        self._factors = FactorFrame(blend.factors)
        shrinkages = blend.shrinkage, blend.residual_shrinkage
        self._matrices = np.stack([shrinkage.matrix for shrinkage in shrinkages])
        self._offsets = np.stack([s.mean - s.mean @ s.matrix for s in shrinkages])
        self._low, self._high = blend.range
        self._weights = blend.weights[[*direct, 2, 3]]
        self._of_processes = blend.weights[[*direct, 3]]
        self._of_factors = blend.weights[2] * blend.doubt**2

    def __call__(self, x: FloatArray) -> tuple[FloatArray, Tell]:
        """See `facert.methods.frame_stream.FrameMap`."""
        told = self._bank(x)
        poses = np.empty((self._direct + 2, len(self._low)))
        poses[: self._direct] = told.poses[:-1]
        said = poses[self._direct :]
        said[:] = self._factors(x)
        self._clip(said)
        said[1] += told.poses[-1]
        self._clip(said)
        said[:] = np.matmul(said[:, None], self._matrices)[:, 0]
        said += self._offsets
        self._clip(poses)
        return self._weights @ poses, lambda: self._variance(told)

    def _variance(self, told: Told) -> FloatArray:
        return np.asarray(self._of_processes @ self._bank.variances(told) + self._of_factors)

    def _clip(self, poses: FloatArray) -> None:
        np.maximum(poses, self._low, out=poses)
        np.minimum(poses, self._high, out=poses)


class ShrunkFrame:
    """`ShrunkProcess` for single frames.

    Parameters
    ----------
    shrunk : ShrunkProcess
    """

    def __init__(self, shrunk: ShrunkProcess) -> None:
        self._bank, self._shrinkage = ProcessBank([shrunk.process]), shrunk.shrinkage

    def __call__(self, x: FloatArray) -> tuple[FloatArray, Tell]:
        """See `facert.methods.frame_stream.FrameMap`."""
        told = self._bank(x)
        pose = self._shrinkage(told.poses[0])
        return pose, lambda: np.repeat(self._bank.variances(told), len(pose))
