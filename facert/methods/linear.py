"""Linear regression, two ways to keep it from following the noise: `ridge` and `pls`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from facert.data.arrays import FloatArray
from facert.methods.folds import blocked_folds
from facert.methods.regression import Map, SupervisedRegression
from facert.models.loo import LinearRidge
from facert.models.partial_least_squares import LeastSquaresComponents

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
        errors = np.zeros(most)
        for train, test in folds:
            poses = LeastSquaresComponents.of(X[train], Y[train], most).outputs(X[test], most)
            errors += np.sum((poses - Y[test]) ** 2, axis=(1, 2))
        components = int(np.argmin(errors)) + 1
        found = LeastSquaresComponents.of(X, Y, components)
        offset = found.mean_Y - found.mean_X @ found.weights
        return LinearMap(found.weights, offset), {"components": components}
