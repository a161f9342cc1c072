"""Semi-supervised regression: features from every frame, shrinkage by every pose.

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

from facert.data import FloatArray
from facert.gp.regression import maximise_likelihood
from facert.methods.base import Labelled, Unlabelled
from facert.methods.features import whitening
from facert.methods.gpr import ProcessMap
from facert.methods.regression import Map, Regression

# Added to the covariance of all poses, relative to its mean variance: few poses leave it singular.
RIDGE = 1e-6


def shrinkage(poses: FloatArray, errors: FloatArray) -> FloatArray:
    """(C + R)⁻¹ C, to be applied to rows of predictions less the mean pose.

    Parameters
    ----------
    poses : array, shape (n, d_y)
        All poses that are known.
    errors : array, shape (l, d_y)
        What the regression missed each label by when that label was left out.

    Returns
    -------
    array, shape (d_y, d_y)
    """
    C = np.atleast_2d(np.cov(poses, rowvar=False, bias=True))
    R = np.diag(np.mean(errors**2, axis=0) + RIDGE * np.trace(C) / len(C))
    return np.linalg.solve(C + R, C).astype(np.float64)


@dataclass(frozen=True, eq=False)
class ShrunkMap(Map):
    """Gaussian process regression on features, shrunk towards poses that are likely.

    Parameters
    ----------
    X, Y : arrays, shapes (n, d_x) and (n, d_y)
        Labelled frames and poses.
    theta : array, shape (4,)
        Of the kernel, see `facert.methods.gpr.ProcessMap`.
    centre : array, shape (d_x,)
        Mean of all frames.
    basis : array, shape (d_x, d_x)
        Of the features, see `facert.methods.features.whitening`.
    mean : array, shape (d_y,)
        Mean of all poses.
    shrink : array, shape (d_y, d_y)
        See `shrinkage`.
    """

    axes: ClassVar[Mapping[str, str]] = {
        "X": "nx",
        "Y": "ny",
        "theta": "4",
        "centre": "x",
        "basis": "xx",
        "mean": "y",
        "shrink": "yy",
    }

    X: FloatArray
    Y: FloatArray
    theta: FloatArray
    centre: FloatArray
    basis: FloatArray
    mean: FloatArray
    shrink: FloatArray

    def __call__(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses of frames X (T, d_x), (T, d_y), and their standard deviation before shrinking."""
        poses, std = self.process(self._features(X))
        return self.mean + poses @ self.shrink, std

    @cached_property
    def process(self) -> ProcessMap:
        """The regression from features to poses less their mean."""
        return ProcessMap(self._features(self.X), self.Y - self.mean, self.theta)

    def _features(self, X: FloatArray) -> FloatArray:
        return (X - self.centre) @ self.basis


class SemiSupervisedGPR(Regression):
    """Linear and squared exponential kernel on half-whitened features, target shrinkage."""

    map_type = ShrunkMap
    power = 0.5  # p of the features

    def _learn(
        self, labelled: Labelled, unlabelled: Unlabelled
    ) -> tuple[ShrunkMap, dict[str, float]]:
        frames = np.vstack([labelled.X, unlabelled.X])
        poses = np.vstack([labelled.Y, unlabelled.Y])
        centre, mean = frames.mean(axis=0), poses.mean(axis=0)
        basis = whitening(frames, self.power)
        features, targets = (labelled.X - centre) @ basis, labelled.Y - mean
        found = maximise_likelihood(features, targets)
        theta = np.array([*found.kernel.theta, found.kernel.linear])
        shrink = shrinkage(poses, ProcessMap(features, targets, theta).left_out_errors)
        made = ShrunkMap(labelled.X, labelled.Y, theta, centre, basis, mean, shrink)
        directions = float(np.count_nonzero(basis.any(axis=0)))
        counts = {"unlabelled frames": len(unlabelled.X), "unlabelled poses": len(unlabelled.Y)}
        return made, {**counts, "log likelihood": found.value, "directions": directions}
