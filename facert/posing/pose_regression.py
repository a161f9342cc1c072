"""Regression from some controls of a pose to the rest: a Gaussian process of rough kernel.

Poses of a performance lie in clusters and on folded sheets: the mouth's corner predicts the cheek,
but not by a smooth curve. The squared exponential, whose draws are smooth everywhere,
must choose a width, and is wrong for some controls. The exponential kernel, with a linear term,

    R(g, g') = (exp(-d/d̄) + gᵀg'/s)/2 + ν δ,        d = |g - g'|,

draws paths like those of a Brownian motion, whose shape does not depend on the width. So the width
is fixed: d̄ is the mean distance of two known poses, s the mean squared length. One eigenvalue
decomposition then serves every noise ν, and each control of the rest has its own: of the noises on
a grid, all are used, weighted by the evidence for them. For one control with values y (n,), at the
scale that is best for it (Rasmussen and Williams 2006, section 5.4.1),

    log P(y | ν) = -1/2 log|R| - n/2 log(yᵀ R⁻¹ y) + constant.

To it is added `TOGETHER` times the mean over all controls of their joint log-evidence: a control
that hardly moves learns its noise from the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import softmax

from facert.data.arrays import FloatArray
from facert.data.memory import require_square
from facert.models.loo import KernelRidge, leave_one_out_errors

NOISES = np.logspace(-3.5, 2.0, 9)
TOGETHER = 3.0
TINY = 1e-12


@dataclass(frozen=True, eq=False)
class PoseRegression:
    """Regression of the other r controls on k given ones, learned from n known poses."""

    # (k,): Mean of each given control, and what its deviations are divided by
    centre: FloatArray
    scale: FloatArray
    inputs: FloatArray  # (n, k): The given controls of the known poses, centred and scaled
    # d̄ and s
    distance: float
    product: float
    mean: FloatArray  # (r,): Of the rest
    weights: FloatArray  # (n, r): R⁻¹ y of each control, averaged over the noises
    errors: FloatArray  # (n, r): Leave-one-out errors of the known poses: truth less prediction

    @classmethod
    def learn(cls, given: FloatArray, rest: FloatArray) -> PoseRegression:
        """The regression from given controls (n, k) of known poses to their rest (n, r)."""
        require_square(len(given), "known poses", "Give fewer.")
        centre, scale, mean = given.mean(axis=0), _scale(given), rest.mean(axis=0)
        inputs = (given - centre) / scale
        distances, products = cdist(inputs, inputs), inputs @ inputs.T
        distance = max(float(distances.mean()), TINY)
        product = max(float(products.diagonal().mean()), TINY)
        R = _kernel(distances / distance, products / product)
        weights, errors = _solve(R, rest - mean)
        return cls(centre, scale, inputs, distance, product, mean, weights, errors)

    def __call__(self, values: FloatArray) -> FloatArray:
        """Predict the other controls, (B, r), from the values of the given ones, (B, k)."""
        inputs = (values - self.centre) / self.scale
        products = inputs @ self.inputs.T / self.product
        return self.mean + _kernel(self.distances(values), products) @ self.weights

    def distances(self, values: FloatArray) -> FloatArray:
        """Distances d/d̄ of values (B, k) from every known pose, (B, n)."""
        inputs = (values - self.centre) / self.scale
        return np.asarray(cdist(inputs, self.inputs) / self.distance)


def _kernel(distances: FloatArray, products: FloatArray) -> FloatArray:
    """R without its noise, from d/d̄ and gᵀg'/s."""
    return np.asarray(np.exp(-distances) + products) / 2.0


def _scale(given: FloatArray) -> FloatArray:
    """Scale of each control: half-way between its own deviation and the largest one.

    A control that moves little is often given with less care, but it is given for a reason. One
    that never moves predicts nothing: its scale is infinite.
    """
    std = given.std(axis=0)
    still = std <= TINY + 1e-9 * np.abs(given).max(axis=0)
    return np.where(still, np.inf, np.sqrt(std * std.max()))


def _solve(R: FloatArray, Y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """R⁻¹ Y, (n, r), and the leave-one-out errors of Y, (n, r), averaged over the noises."""
    ridge = KernelRidge.of(R, Y)
    precisions = 1.0 / (ridge.values[:, None] + NOISES)  # (n, noises)
    weights, errors = np.zeros_like(Y), np.zeros_like(Y)
    for noise, share in zip(NOISES, _shares(precisions, ridge.projected), strict=True):
        weighted = share * ridge.weights(noise)
        weights += weighted
        errors += leave_one_out_errors(weighted, ridge.diagonal(noise))
    return weights, errors


def _shares(precisions: FloatArray, along: FloatArray) -> FloatArray:
    """The weight of each noise for each control, (noises, r), by the evidence for it."""
    n = len(along)
    squares = precisions.T @ along**2 + TINY  # yᵀ R⁻¹ y
    half_log_det = -0.5 * np.log(precisions).sum(axis=0)[:, None]
    own = -half_log_det - 0.5 * n * np.log(squares)
    joint = -half_log_det - 0.5 * n * np.log(squares.sum(axis=1, keepdims=True) + TINY)
    return np.asarray(softmax(own + TOGETHER * joint, axis=0))
