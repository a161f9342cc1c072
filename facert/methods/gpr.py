"""Gaussian process regression: `gpr` with the paper's kernel, `gpr-linear` with a linear term.

The process has mean zero in normalised units: before it has seen a label it expects the mean of all
poses that are known, animation included.
"""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray
from facert.methods.processes import ProcessMap
from facert.methods.regression import SupervisedRegression
from facert.models.gp.hyperparameters import LINEAR_BOUNDS, NO_LINEAR_TERM, maximise_likelihood


class GPR(SupervisedRegression):
    """Gaussian process regression with the squared exponential, the paper's baseline."""

    map_type = ProcessMap
    linear_bounds = NO_LINEAR_TERM

    def _regress(self, X: FloatArray, Y: FloatArray) -> tuple[ProcessMap, dict[str, float]]:
        found = maximise_likelihood(X, Y, self.linear_bounds)
        theta = np.array([*found.kernel.theta, found.kernel.linear])
        figures = {f"theta{index}": float(value) for index, value in enumerate(theta, start=1)}
        searched = "" if found.rows == len(X) else f" of {found.rows} labels"
        return ProcessMap(X, Y, theta), {f"log likelihood{searched}": found.value, **figures}


class LinearGPR(GPR):
    """Gaussian process regression with the squared exponential and a linear term."""

    linear_bounds = LINEAR_BOUNDS
