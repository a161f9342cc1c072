"""Shrinkage of predictions towards likely poses.

Poses with a frame determine a regression f from the source; all poses show which are likely at all.
Let ȳ and C be their mean and covariance, and let R hold the mean squared error of f for each
control in cross-validation. To a prediction p = y + e with e ~ N(0, R), the most probable pose
under y ~ N(ȳ, C) is

    y = ȳ + C (C + R)⁻¹ (p - ȳ):

controls that f predicts badly follow from those that it predicts well.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from facert.data.array_group import ArrayGroup
from facert.data.arrays import FloatArray

# Added to the covariance of all poses, relative to its mean variance: few poses leave it singular.
RIDGE = 1e-6


@dataclass(frozen=True, eq=False)
class Shrinkage(ArrayGroup):
    """The linear map from predicted poses to likely ones."""

    mean: Annotated[FloatArray, "y"]  # (d_y,): ȳ
    matrix: Annotated[FloatArray, "yy"]  # (d_y, d_y): (C + R)⁻¹ C, to be applied to rows

    @classmethod
    def learn(cls, poses: FloatArray, errors: FloatArray) -> Shrinkage:
        """The shrinkage by all known poses (n, d_y) and cross-validated errors (l, d_y)."""
        C = np.atleast_2d(np.cov(poses, rowvar=False, bias=True))
        # Poses that are all the same have no variance at all.
        ridge = max(RIDGE * float(np.trace(C)) / len(C), np.finfo(np.float64).tiny)
        R = np.diag(np.mean(errors**2, axis=0) + ridge)
        return cls(poses.mean(axis=0), np.linalg.solve(C + R, C).astype(np.float64))

    def __call__(self, poses: FloatArray) -> FloatArray:
        """Likely poses in place of predicted ones, (T, d_y)."""
        return poses @ self.matrix + self.offset

    @cached_property
    def offset(self) -> FloatArray:
        """The likely pose in place of the pose 0, (d_y,)."""
        return np.asarray(self.mean - self.mean @ self.matrix)
