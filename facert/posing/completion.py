"""The pose to expect given some of its controls, and others that are plausible too.

`facert.posing.pose_regression` predicts the rest of the pose. How far it may be off follows from
the leave-one-out error e_i of each known pose. A plausible pose is the predicted one plus the error
of a known pose that has similar given controls,

    y = clip(f(g) + √(1 + 2 min d) e_i),      P(i) ~ exp(-γ d_i) + ε/n,      d_i = |g - g_i|/d̄,

in other words a known pose, carried to the given values: its controls vary together as real ones
do, and those that are still stay still. The variance of a path like those of the regression's
kernel grows with the distance from what is known of it. The standard deviation is that of y before
it is clipped.

Soft values g ± s are observations of what the given controls should be. With m and C mean and
covariance of the given controls in the known poses, they become

    ĝ = m + C (C + s² I)⁻¹ (g - m),      V = C - C (C + s² I)⁻¹ C,

and the spread of f over N(ĝ, V), by 2k sigma points, adds to the variance (Julier and Uhlmann
1997).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.posing.pose_regression import PoseRegression
from facert.preprocess.known_poses import Given, KnownPoses

NEAR = 8.0  # γ
ANYWHERE = 0.3  # ε: a few near poses may agree by chance
STILL = 1e-13  # share of the largest variance: below, known poses do not vary along a direction


@dataclass(frozen=True, eq=False)
class Posed:
    """A pose, how certain it is, and samples of other plausible poses."""

    # (P,): The most probable pose, and the standard deviation of each control
    pose: FloatArray
    std: FloatArray
    samples: FloatArray  # (N, P): Other plausible poses


@dataclass(frozen=True, eq=False)
class Completion:
    """Completes poses of which the same controls are given; made by `learn`."""

    known: KnownPoses  # n of them
    # (k,) and (r,): The given controls, and the others
    given: IntArray
    rest: IntArray
    regression: PoseRegression
    # (n, r): Leave-one-out errors of the clipped predictions of the known poses
    errors: FloatArray

    @classmethod
    def learn(cls, known: KnownPoses, given: IntArray) -> Completion:
        """The completion for given controls (k,), from known poses."""
        poses = known.poses
        rest = np.setdiff1d(np.arange(poses.shape[1]), given)
        regression = PoseRegression.learn(poses[:, given], poses[:, rest])
        predicted = np.clip(poses[:, rest] - regression.errors, *known.bounds[rest].T)
        return cls(known, given, rest, regression, poses[:, rest] - predicted)

    def complete(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses whose given controls have these values exactly.

        Parameters
        ----------
        values : array, shape (B, k)

        Returns
        -------
        poses, std : arrays, shape (B, P)
            The standard deviation of a given control is 0.
        """
        shares, widening = self._nearby(values)
        variance = shares @ self.errors**2 - (shares @ self.errors) ** 2
        spread = widening * np.sqrt(np.maximum(variance, 0.0))
        return self._whole(values, self.regression(values)), self._joined(0.0, spread)

    def pose(self, given: Given, samples: int, rng: np.random.Generator) -> Posed:
        """The pose with given values (k,), or with values near them, and other plausible ones.

        Parameters
        ----------
        given : Given
            Its controls are those that this was learned for.
        samples : int
            Number of other poses to draw.
        rng : numpy.random.Generator
        """
        likely, roots = self._likely(given)
        poses, std = self.complete(np.vstack([likely, likely + roots, likely - roots]))
        spread = np.sum((poses[1:] - poses[0]) ** 2, axis=0) / 2.0 / len(likely)
        noise = rng.standard_normal((samples, len(roots))) @ roots / np.sqrt(len(likely))
        low, high = self.known.bounds[self.given].T
        near = np.clip(likely + noise, np.minimum(low, likely), np.maximum(high, likely))
        drawn = self.sample(near, rng)
        return Posed(poses[0], np.sqrt(std[0] ** 2 + spread), drawn)

    def sample(self, values: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draw a plausible pose (B, P) for each row of values (B, k)."""
        shares, widening = self._nearby(values)
        edges = np.cumsum(shares, axis=1)
        chosen = np.sum(rng.random((len(values), 1)) * edges[:, -1:] > edges, axis=1)
        return self._whole(values, self.regression(values) + widening * self.errors[chosen])

    def farness(self, values: FloatArray) -> float:
        """Distance of values (k,) from the nearest known pose, in mean distances of two poses."""
        return float(self.regression.distances(values[None]).min())

    def _likely(self, given: Given) -> tuple[FloatArray, FloatArray]:
        """Likely values ĝ (k,), and a root of k V, (k, k), without rows for hard values."""
        values = given.values
        if given.soft == 0.0:
            return values, np.zeros((0, len(values)))
        known = self.known.poses[:, self.given]
        mean, C = known.mean(axis=0), np.atleast_2d(np.cov(known, rowvar=False))
        variances, directions = np.linalg.eigh(C)
        variances[variances <= STILL * variances.max()] = 0.0
        shares = variances / (variances + given.soft**2)
        roots = (directions * np.sqrt(shares * given.soft**2 * len(C))).T
        likely = mean + directions @ (shares * (directions.T @ (values - mean)))
        return np.clip(likely, *self.known.bounds[self.given].T), roots

    def _nearby(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Weights P(i) of known poses for values (B, k), (B, n); and √(1 + 2 min d), (B, 1)."""
        distances = self.regression.distances(values)
        w = np.exp(-NEAR * distances) + ANYWHERE / distances.shape[1]
        widening = np.sqrt(1.0 + 2.0 * distances.min(axis=1, keepdims=True))
        return w / w.sum(axis=1, keepdims=True), widening

    def _whole(self, values: FloatArray, rest: FloatArray) -> FloatArray:
        """Poses (B, P) of given values (B, k) and the other controls (B, r), clipped."""
        return self._joined(values, np.clip(rest, *self.known.bounds[self.rest].T))

    def _joined(self, given: FloatArray | float, rest: FloatArray) -> FloatArray:
        joined = np.empty((len(rest), self.known.poses.shape[1]))
        joined[:, self.given], joined[:, self.rest] = given, rest
        return joined
