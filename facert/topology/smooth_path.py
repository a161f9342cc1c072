"""The smoothest path in time through the key poses, and how far to trust it between them.

The smoothest path, ∫ ‖y''‖² dt = trace(Ŷᵀ S Ŷ) least, is Y = A Ŷ. As a prior of the target it is a
Gaussian process, whose covariance between the keys is the pseudo-inverse S⁺, and A S⁺ between all
frames and the keys.

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
RANK = 1e-15  # share of the largest stiffness: less is rounding
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
    stiffness : array, shape (K, K)
        S: its ∫ y''² is trace(Ŷᵀ S Ŷ).
    """

    def __init__(self, frames: int, keys: IntArray) -> None:
        order = np.argsort(keys)
        times = keys[order].astype(np.float64)
        spline = CubicSpline(times, np.eye(len(keys))[order], bc_type="clamped")
        self.influence: FloatArray = spline(np.clip(np.arange(frames), times[0], times[-1]))
        bent = spline(times, 2)  # the second derivative, linear between the keys
        before, after, gap = bent[:-1], bent[1:], np.diff(times)[:, None] / 6.0
        product = before.T @ (gap * after)
        ends = before.T @ (gap * before) + after.T @ (gap * after)
        self.stiffness: FloatArray = 2.0 * ends + product + product.T

    def covariance(self) -> FloatArray:
        """Covariance of all frames with the keys, (T, K), for paths less their mean over the keys.

        Rows add up to 0, so do the rows of the keys, and the mean variance of the keys is 1.
        """
        stiffness, paths = np.linalg.eigh(self.stiffness)
        paths -= paths.mean(axis=0)
        # S⁺ without the first path, the constant, which alone bends nothing: S has rank K - 1.
        bent = np.maximum(stiffness[1:], RANK * stiffness[-1])
        between_keys = (paths[:, 1:] / bent) @ paths[:, 1:].T
        return np.asarray(self.influence @ between_keys / between_keys.diagonal().mean())

    def missed(self, take: KeyedPerformance) -> float:
        """Error ε of the path through the source's key frames, as a share of its motion."""
        motion = float(np.linalg.norm(take.frames - take.frames.mean(axis=0)))
        path = self.influence @ take.frames[take.keys]
        return float(np.linalg.norm(path - take.frames)) / motion if motion > 0 else 0.0


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
