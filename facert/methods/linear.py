"""Linear regression, two ways to keep it from following the noise: `ridge` and `pls`."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from sklearn.cross_decomposition import PLSRegression

from facert.data.arrays import FloatArray
from facert.methods.folds import blocked_folds
from facert.methods.regression import Map, SupervisedRegression

# Penalties relative to the mean sum of squares of a frame.
PENALTIES = np.logspace(-7, 2, 46)
MAX_COMPONENTS = 20


@dataclass(frozen=True, eq=False)
class LinearMap(Map):
    """Y = X W + b.

    Parameters
    ----------
    weights : array, shape (d_x, d_y)
        W.
    offset : array, shape (d_y,)
        b.
    """

    predicts_std: ClassVar[bool] = False
    axes: ClassVar[Mapping[str, str]] = {"weights": "xy", "offset": "y"}

    weights: FloatArray
    offset: FloatArray

    def __call__(self, X: FloatArray) -> tuple[FloatArray, None]:
        """Poses of frames X (T, d_x), (T, d_y)."""
        return X @ self.weights + self.offset, None


class Ridge(SupervisedRegression):
    """Ridge regression, the penalty of each control chosen by leave-one-out error in closed form.

    There is no free offset: what the labels do not tell falls back on the mean of all known poses.
    """

    map_type = LinearMap

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[LinearMap, dict[str, float]]:
        found = leave_one_out_ridge(X, Y)
        figures = {"median penalty": float(np.median(found.penalties))}
        return LinearMap(found.weights, np.zeros(Y.shape[1])), figures


@dataclass(frozen=True, eq=False)
class RidgeFit:
    """A ridge regression without offset.

    Parameters
    ----------
    weights : array, shape (d_x, d_y)
        W.
    penalties : array, shape (d_y,)
        Of each control, relative to the mean sum of squares of a frame.
    left_out_errors : array, shape (n, d_y)
        Each row less what is said of it when it is left out.
    """

    weights: FloatArray
    penalties: FloatArray
    left_out_errors: FloatArray


def leave_one_out_ridge(X: FloatArray, Y: FloatArray) -> RidgeFit:
    """Ridge regression, each control's penalty λ the one of least leave-one-out error.

    With X = U S Vᵀ and h the diagonal of H = U S²(S² + λ)⁻¹ Uᵀ, leaving a row out misses it by
    (Y - H Y)_i / (1 - h_i).

    Parameters
    ----------
    X, Y : arrays, shapes (n, d_x) and (n, d_y)
        With mean zero, or with an offset that is known.
    """
    U, S, Vt = np.linalg.svd(X, full_matrices=False)
    scale = max(float(np.sum(X * X)) / len(X), np.finfo(np.float64).tiny)
    penalty = PENALTIES[:, None] * scale
    filters = S**2 / (S**2 + penalty)  # (penalties, r)
    projected = U.T @ Y
    residuals = Y - (U * filters[:, None, :]) @ projected
    leverages = filters @ (U**2).T
    errors = residuals / (1.0 - leverages)[:, :, None]
    best = np.sum(errors**2, axis=1).argmin(axis=0)
    inverse = S / (S**2 + penalty)
    weights = Vt.T @ (inverse[best].T * projected)
    chosen = errors[best, :, np.arange(Y.shape[1])].T
    return RidgeFit(weights, PENALTIES[best], chosen)


class PLS(SupervisedRegression):
    """Partial least squares, the number of components chosen by blocked cross-validation."""

    map_type = LinearMap

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[LinearMap, dict[str, float]]:
        folds = blocked_folds(len(X))
        # The smallest fold decides; centring takes one more.
        most = min(MAX_COMPONENTS, X.shape[1], *(len(train) - 1 for train, _ in folds))
        errors = sum(
            np.sum((_poses_by_components(X[train], Y[train], X[test], most) - Y[test]) ** 2, (1, 2))
            for train, test in folds
        )
        components = int(np.argmin(errors)) + 1
        found = _components(X, Y, components)
        weights = found.coef_.T.copy()
        offset = found.intercept_ - X.mean(axis=0) @ weights
        return LinearMap(weights, offset), {"components": components}


def _poses_by_components(X: FloatArray, Y: FloatArray, frames: FloatArray, most: int) -> FloatArray:
    """What 1 to `most` components say about frames (T, d_x), (most, T, d_y).

    Components are found one after the other: each model is the next with its last term left off.
    """
    model = _components(X, Y, most)
    scores = (frames - X.mean(axis=0)) @ model.x_rotations_
    terms = scores.T[:, :, None] * model.y_loadings_.T[:, None, :]
    poses: FloatArray = Y.mean(axis=0) + np.cumsum(terms, axis=0)
    return poses


def _components(X: FloatArray, Y: FloatArray, count: int) -> PLSRegression:
    with warnings.catch_warnings():
        # Where fewer components explain everything the others are zero, which does no harm.
        warnings.filterwarnings("ignore", "y residual is constant", UserWarning)
        return PLSRegression(count, scale=False).fit(X, Y)
