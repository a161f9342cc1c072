"""Interpolation between poses (`rbf`), and the nearest one (`nearest`), as in pose drivers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial.distance import cdist

from facert.data.arrays import FloatArray
from facert.data.blocks import in_blocks
from facert.data.memory import FLOAT, require_memory
from facert.methods.regression import MOST_KERNELS, Map, SupervisedRegression

# Enough for a frame that was posed twice, differently, to be no contradiction.
SMOOTHING = 1e-3


@dataclass(frozen=True, eq=False)
class InterpolatingMap(Map):
    """Radial basis functions |x - x_i| around the posed frames, and a constant."""

    predicts_std: ClassVar[bool] = False

    # (n, d_x) and (n, d_y): Posed frames
    X: Annotated[FloatArray, "nx"]
    Y: Annotated[FloatArray, "ny"]
    # (1,): How far from going through the poses exactly, in normalised units of length
    smoothing: Annotated[FloatArray, "1"]

    def __call__(self, X: FloatArray) -> tuple[FloatArray, None]:
        """Poses of frames X (T, d_x), (T, d_y)."""
        return self._interpolator(X), None

    @cached_property
    def _interpolator(self) -> RBFInterpolator:
        n = len(self.X)
        require_memory(2 * FLOAT * n**2, f"interpolation between {n} poses", "Train on fewer.")
        return RBFInterpolator(
            self.X, self.Y, kernel="linear", degree=0, smoothing=self.smoothing.item()
        )


class RBF(SupervisedRegression):
    """Radial basis function interpolation with the linear kernel.

    Of the standard kernels the linear one suits few examples in many dimensions: it needs no
    length, and does not overshoot between them as thin plates and cubics do.
    """

    map_type = InterpolatingMap

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[InterpolatingMap, dict[str, float]]:
        return InterpolatingMap(X, Y, np.array([SMOOTHING])), {}


@dataclass(frozen=True, eq=False)
class NearestMap(Map):
    """The pose of the most similar frame."""

    predicts_std: ClassVar[bool] = False

    # (n, d_x) and (n, d_y): Posed frames
    X: Annotated[FloatArray, "nx"]
    Y: Annotated[FloatArray, "ny"]

    def __call__(self, X: FloatArray) -> tuple[FloatArray, None]:
        """Poses of frames X (T, d_x), (T, d_y)."""
        return in_blocks(self._poses, X, len(self.X), MOST_KERNELS), None

    def _poses(self, X: FloatArray) -> FloatArray:
        return np.asarray(self.Y[cdist(X, self.X, "sqeuclidean").argmin(axis=1)])


class Nearest(SupervisedRegression):
    """The pose of the posed frame that is nearest."""

    map_type = NearestMap

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[NearestMap, dict[str, float]]:
        return NearestMap(X, Y), {}
