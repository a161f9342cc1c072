"""Shrinkage of predictions towards likely poses.

Of the poses, the labels tell a regression f from the source; the others tell which poses are likely
at all. Let ȳ and C be mean and covariance of all poses, and let R hold the mean squared error of f
for each control, as found by leaving each label out. To a prediction p = y + e with e ~ N(0, R),
the most probable pose under y ~ N(ȳ, C) is

    y = ȳ + C (C + R)⁻¹ (p - ȳ):

controls that f predicts badly are told by those that it predicts well. The leave-one-out errors of
a Gaussian process are known in closed form, (K⁻¹Y)_i / (K⁻¹)_ii (Rasmussen and Williams 2006, Eq.
5.12).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from facert.data.array_group import ArrayGroup
from facert.data.arrays import FloatArray

# Added to the covariance of all poses, relative to its mean variance: few poses leave it singular.
RIDGE = 1e-6


@dataclass(frozen=True, eq=False)
class Shrinkage(ArrayGroup):
    """What takes a predicted pose to a likely one.

    Parameters
    ----------
    mean : array, shape (d_y,)
        ȳ.
    matrix : array, shape (d_y, d_y)
        (C + R)⁻¹ C, to be applied to rows.
    """

    axes: ClassVar[Mapping[str, str]] = {"mean": "y", "matrix": "yy"}

    mean: FloatArray
    matrix: FloatArray

    @classmethod
    def learn(cls, poses: FloatArray, errors: FloatArray) -> Shrinkage:
        """From all poses that are known, (n, d_y), and the errors at labels left out, (l, d_y)."""
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
