"""Linear regression, two ways to keep it from following the noise: `ridge` and `pls`."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from sklearn.cross_decomposition import PLSRegression

from facert.data.arrays import FloatArray
from facert.methods.folds import blocked_folds
from facert.methods.regression import Map, SupervisedRegression
from facert.models.loo import LinearRidge

# Penalties relative to the mean sum of squares of a frame.
PENALTIES = np.logspace(-7, 2, 46)
MAX_COMPONENTS = 20


@dataclass(frozen=True, eq=False)
class LinearMap(Map):
    """Y = X W + b."""

    predicts_std: ClassVar[bool] = False

    weights: Annotated[FloatArray, "xy"]  # (d_x, d_y): W
    offset: Annotated[FloatArray, "y"]  # (d_y,): b

    def __call__(self, X: FloatArray) -> tuple[FloatArray, None]:
        """Poses of frames X (T, d_x), (T, d_y)."""
        return X @ self.weights + self.offset, None


class Ridge(SupervisedRegression):
    """Ridge regression, the penalty of each control chosen by leave-one-out error in closed form.

    There is no free offset: what the labels leave open falls back on the mean of all known poses.
    """

    map_type = LinearMap

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[LinearMap, dict[str, float]]:
        ridge = LinearRidge.of_inputs(X, Y)
        scale = max(float(np.sum(X * X)) / len(X), np.finfo(np.float64).tiny)
        errors = [np.sum(ridge.errors(scale * penalty) ** 2, axis=0) for penalty in PENALTIES]
        penalties = PENALTIES[np.argmin(errors, axis=0)]
        figures = {"median penalty": float(np.median(penalties))}
        return LinearMap(ridge.slopes(scale * penalties), np.zeros(Y.shape[1])), figures


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
    """Poses of frames (T, d_x) by 1 to `most` components, (most, T, d_y).

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
