"""Factors that frames and poses share, learned from pairs, frames alone and poses alone.

    z ~ N(0, I),      x = W_x z + e_x,      y* = μ + W_y z + e_y,      y = clip(y*),

with noise e_x ~ N(0, σ² I) and e_y ~ N(0, Ψ), Ψ diagonal. This is the shared latent variable model
with a linear kernel in its primal form: where `facert.models.gplvm` integrates the weights out and
seeks the latent coordinates, this one integrates the latent coordinates out and seeks the weights,
so that a frame without a pose costs no unknowns. It is factor analysis of two views (Bach and
Jordan 2005), of which most frames and most poses show one.

It draws much from unlabelled data. Frames alone give the covariance W_x W_xᵀ + σ² I, and
poses alone W_y W_yᵀ + Ψ: each fixes its weights but for a rotation of the factors, and the labels
are left with that rotation alone to find. Clipping: see `facert.models.factors.censoring`.

The expectation-maximisation algorithm finds the weights. Given z, the views are independent, so
that with P_x = W_xᵀ W_x/σ² and P_y = W_yᵀ Ψ⁻¹ W_y the posterior of z has the covariance
(I + P)⁻¹, where P sums the views that are there. Entries at a limit are replaced by what the
current model expects behind it. The weights then solve

    W (Σ E[z zᵀ] + k I) = Σ v E[z]ᵀ + k W₀,

v the view's rows: least squares with a prior around the weights W₀ with which the search began,
worth k rows. Of frames nothing but Σ x xᵀ is needed, however many there are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray
from facert.models.factors.censoring import CensoredPoses, CensoringLimits

FACTORS = 24  # at most
ITERATIONS = 100
# Least noise variances, in normalised units. Without them a clean capture drives σ² to zero, and
# directions in which the training frames hardly move are magnified.
SOURCE_FLOOR = 3e-5
TARGET_FLOOR = 1.5e-2
# Ψ of a control is estimated as if so many more poses had shown the mean of all controls.
PRIOR_POSES = 20.0
# k as a share of all rows of the view.
PRIOR_SHARE = 0.02


@dataclass(frozen=True, eq=False)
class FactorData:
    """Pairs, frames and poses to learn factors from; both views with mean zero."""

    # (l, d_x) and (l, d_y): Frames with their poses
    X: FloatArray
    Y: FloatArray
    frames: FloatArray  # (m, d_x): Frames without a pose
    poses: FloatArray  # (n, d_y): Poses without a frame
    limits: CensoringLimits  # Of the poses


@dataclass(frozen=True, eq=False)
class FactorModel:
    """The weights of both views and their noise."""

    # (d_x, q) and (d_y, q)
    Wx: FloatArray
    Wy: FloatArray
    mean: FloatArray  # (d_y,): μ
    noise_x: float  # σ²
    noise_y: FloatArray  # (d_y,): The diagonal of Ψ

    @property
    def seen_by_frames(self) -> FloatArray:
        """P_x, (q, q)."""
        return self.Wx.T @ self.Wx / self.noise_x

    @property
    def seen_by_poses(self) -> FloatArray:
        """P_y, (q, q)."""
        return (self.Wy.T / self.noise_y) @ self.Wy

    def weigh_poses(self, Y: FloatArray) -> FloatArray:
        """Ψ⁻¹ W_y applied to free poses (n, d_y), (n, q)."""
        return ((Y - self.mean) / self.noise_y) @ self.Wy

    def regression(self) -> tuple[FloatArray, FloatArray]:
        """The free pose given its frame: y* = μ + x B, with standard deviation s.

        Returns
        -------
        B : array, shape (d_x, d_y)
        s : array, shape (d_y,)
        """
        C = covariance(self.seen_by_frames)
        B = (self.Wx / self.noise_x) @ C @ self.Wy.T
        return B, np.sqrt(self.noise_y + np.sum((self.Wy @ C) * self.Wy, axis=1))


def covariance(P: FloatArray) -> FloatArray:
    """(I + P)⁻¹, the covariance of factors with the precision P from the views seen."""
    return np.asarray(np.linalg.inv(np.eye(len(P)) + P), dtype=np.float64)


def learn_factors(data: FactorData, guess: FloatArray) -> FactorModel:
    """The factors behind both views.

    Parameters
    ----------
    data : FactorData
    guess : array, shape (m, d_y)
        Poses that another method predicts for the frames without one. The search begins at, and
        its prior is around, the principal components of frames joined with poses.
    """
    search = _Search(data, _principal_factors(data, guess))
    for _ in range(ITERATIONS):
        search.step()
    return search.factors


def _principal_factors(data: FactorData, guess: FloatArray) -> FactorModel:
    joined = np.vstack([np.hstack([data.X, data.Y]), np.hstack([data.frames, guess])])
    d_x = data.X.shape[1]
    variances, directions = np.linalg.eigh(joined.T @ joined / len(joined))
    q = min(FACTORS, len(joined) - 1, joined.shape[1] - 1)
    W = directions[:, -q:] * np.sqrt(np.maximum(variances[-q:], 0.0))
    rest = float(np.maximum(variances[:-q], 0.0).sum()) / d_x
    d_y = len(W) - d_x
    return FactorModel(
        W[:d_x], W[d_x:], np.zeros(d_y), max(rest, SOURCE_FLOOR), np.full(d_y, TARGET_FLOOR)
    )


class _Search:
    """Steps of the expectation-maximisation algorithm."""

    def __init__(self, data: FactorData, start: FactorModel) -> None:
        self.factors, self.start = start, start
        self.X, self.Y, self.poses = data.X, data.Y, data.poses
        self.paired = CensoredPoses.of(data.Y, data.limits)
        self.alone = CensoredPoses.of(data.poses, data.limits)
        self.count = len(data.frames)
        self.moments = data.frames.T @ data.frames

    def step(self) -> None:
        """Expect the factors of every row and the free poses, then find the weights."""
        now, X, count = self.factors, self.X, self.count
        P_x, P_y = now.seen_by_frames, now.seen_by_poses
        C_both, C_x, C_y = (covariance(P) for P in (P_x + P_y, P_x, P_y))
        pull = now.Wx / now.noise_x  # a frame's factors are x pull C
        Z = (X @ pull + now.weigh_poses(self.Y)) @ C_both
        Z_alone = now.weigh_poses(self.poses) @ C_y
        both = Z.T @ Z + len(X) * C_both

        A = pull @ C_x
        Wx, rest_x = _regress(
            products=X.T @ Z + self.moments @ A,
            squares=both + A.T @ self.moments @ A + count * C_x,
            totals=np.sum(X**2, axis=0) + self.moments.diagonal(),
            prior=self.start.Wx,
            rows=len(X) + count,
        )
        mean, spread = self._free_poses(Z, Z_alone)
        Y, poses = self.Y - mean, self.poses - mean
        n = len(Y) + len(poses)
        Wy, rest_y = _regress(
            products=Y.T @ Z + poses.T @ Z_alone,
            squares=both + Z_alone.T @ Z_alone + len(poses) * C_y,
            totals=np.sum(Y**2, axis=0) + np.sum(poses**2, axis=0) + spread,
            prior=self.start.Wy,
            rows=n,
        )
        noise_x = rest_x.sum() / ((len(X) + count) * len(rest_x))
        noise_y = (rest_y + PRIOR_POSES * rest_y.mean() / n) / (n + PRIOR_POSES)
        self.factors = FactorModel(
            Wx,
            Wy,
            mean,
            max(float(noise_x), SOURCE_FLOOR),
            np.maximum(noise_y, TARGET_FLOOR),
        )

    def _free_poses(self, Z: FloatArray, Z_alone: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Expect the free poses; their mean beside the factors, and their summed variances."""
        now, std = self.factors, np.sqrt(self.factors.noise_y)
        predicted, predicted_alone = Z @ now.Wy.T, Z_alone @ now.Wy.T
        self.Y, spread = self.paired.free(now.mean + predicted, std)
        self.poses, spread_alone = self.alone.free(now.mean + predicted_alone, std)
        total = np.sum(self.Y - predicted, axis=0)
        total += np.sum(self.poses - predicted_alone, axis=0)
        return total / (len(Z) + len(Z_alone)), spread + spread_alone


def _regress(
    products: FloatArray, squares: FloatArray, totals: FloatArray, prior: FloatArray, rows: int
) -> tuple[FloatArray, FloatArray]:
    """Weights W of a view, (d, q), and the residual sum of its squares, (d,).

    Parameters
    ----------
    products, squares : arrays, shapes (d, q) and (q, q)
        Σ v E[z]ᵀ and Σ E[z zᵀ].
    totals : array, shape (d,)
        Σ v², of each dimension.
    prior : array, shape (d, q)
        W₀.
    rows : int
        Number of rows of the view.
    """
    k = PRIOR_SHARE * rows
    solution = np.linalg.solve(squares + k * np.eye(len(squares)), (products + k * prior).T)
    W: FloatArray = np.asarray(solution.T, dtype=np.float64)
    rest = totals - 2.0 * np.sum(W * products, axis=1) + np.sum((W @ squares) * W, axis=1)
    return W, np.maximum(rest, 0.0)
