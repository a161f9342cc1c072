"""The smoothest path in time through the key poses, and how far to trust it between them.

The smoothest path, ∫ ‖y''‖² dt = trace(Ŷᵀ S Ŷ) least, is Y = A Ŷ. As a prior of the target it is a
Gaussian process: from an unknown constant, the integral of a Brownian bridge, as y' is at rest in
the first key, at time 0, and in the last, at 1. Its covariance

    k(s, t) = s² (6 t - 2 s - 3 t²) / 12,      s ≤ t,

less the means over the keys is S⁺ between the keys, and A S⁺ between all frames and the keys. So
neither is S needed nor its rank, which rounding would decide where keys come in bursts.

How far to trust the path cannot be learned from the key poses: to leave one out doubles the gap
that the path must bridge. But of the source all frames are known. Where the path through its key
frames misses little of it, as in a slow rise to an expression and back, the target follows such a
path too; in speech it does not. And where the target follows the source linearly, nothing is left
for the path to explain.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from facert.data.arrays import FloatArray, IntArray
from facert.topology.keyed import KeyedPerformance

MOST = 30.0  # τ where the path misses nothing of the source
BALANCE = 0.2  # times what a linear map misses: where time is trusted half as much
STEEPNESS = 6
FARTHEST = 1e13  # ratio beyond which τ is 0


class SmoothPath:
    """The smoothest path in time through any values of the key frames.

    A cubic spline: of all curves that are at rest in the first and the last key, and before and
    after, it has the least ∫ y''².

    Parameters
    ----------
    frames : int
        T.
    keys : array of int, shape (K,)
        Different frames, in any order.

    Attributes
    ----------
    influence : array, shape (T, K)
        A: the path is A Ŷ.
    """

    def __init__(self, frames: int, keys: IntArray) -> None:
        order = np.argsort(keys)
        times = keys[order].astype(np.float64)
        frames_within = np.clip(np.arange(frames), times[0], times[-1])
        spline = CubicSpline(times, np.eye(len(keys))[order], bc_type="clamped")
        self.influence: FloatArray = spline(frames_within)
        self._frames = (frames_within - times[0]) / (times[-1] - times[0])  # times from 0 to 1
        self._keys = keys

    def covariance(self) -> FloatArray:
        """Covariance of all frames with the keys, (T, K), for paths less their mean over the keys.

        Rows add up to 0, so do the rows of the keys, and the mean variance of the keys is 1.
        """
        with_keys = integrated_bridge(self._frames[:, None], self._frames[self._keys])
        with_keys -= with_keys[self._keys].mean(axis=0)
        with_keys -= with_keys.mean(axis=1, keepdims=True)
        return np.asarray(with_keys / with_keys[self._keys].diagonal().mean())

    def missed(self, take: KeyedPerformance) -> float:
        """Error ε of the path through the source's key frames, as a share of its motion."""
        motion = float(np.linalg.norm(take.frames - take.frames.mean(axis=0)))
        path = self.influence @ take.frames[take.keys]
        return float(np.linalg.norm(path - take.frames)) / motion if motion > 0 else 0.0


def integrated_bridge(s: FloatArray, t: FloatArray) -> FloatArray:
    """Covariance k(s, t) of the integral of a Brownian bridge, at times from 0 to 1."""
    early, late = np.minimum(s, t), np.maximum(s, t)
    return np.asarray(early**2 * (6.0 * late - 2.0 * early - 3.0 * late**2) / 12.0)


def trust_in_path(by_path: float, by_map: float) -> float:
    """The path's variance τ in the kernel, from 0 to 30.

    Parameters
    ----------
    by_path : float
        ε, what the path misses of the source.
    by_map : float
        δ, the leave-one-out error of a linear map from the source. Both are shares of the motion.
    """
    if by_map <= 0:
        return 0.0
    ratio = by_path / (BALANCE * by_map)
    return float(MOST / (1.0 + ratio**STEEPNESS)) if ratio < FARTHEST else 0.0
