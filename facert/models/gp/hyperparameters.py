"""Gaussian process regression: a kernel with a linear term, and its maximum likelihood.

    k(x, x') = θ1 exp(-θ2/2 |x - x'|²) + θ4 xᵀx' + θ3⁻¹ δ,

the squared exponential of Eq. (3) in Bouaziz and Pauly (2014), and a linear term that extrapolates.
All columns of the target share it. Inputs are fixed: distances and products are computed once.

Parameters are found on the *profile* of the likelihood (Rasmussen and Williams 2006, section
5.4.1, with the scale maximised out). Write K = s R with

    R = (C + λ G)/(1 + λ) + ν I,      C = exp(-w/2 D),

D the squared distances divided by their mean, G the products divided by the mean of their diagonal.
For n rows and d columns, s = tr(R⁻¹ Y Yᵀ)/(n d) is best whatever R is, and

    -log P(Y|X) = d/2 log|R| + n d/2 (log s + 1 + log 2π),
    Γ = ∂(-log P)/∂R = (d R⁻¹ - A Aᵀ/s)/2,      A = R⁻¹ Y.

Two or three parameters are left, w, ν and λ, none of which depends on a unit; and R is never
conditioned worse than 1/ν.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

from facert.data.arrays import FloatArray
from facert.models.kernels import RegressionKernel, squared_exponential

# Of (log w, log ν, log λ). The widest kernel is as good as linear, the narrowest as good as noise.
WIDTH_BOUNDS = (math.log(1e-6), math.log(1e3))
NOISE_BOUNDS = (math.log(1e-11), math.log(1e4))
LINEAR_BOUNDS = (math.log(1e-6), math.log(1e6))
NO_LINEAR_TERM = (-1e3, -1e3)  # e to this power is 0 exactly
LEAST_SCALE = 1e-20  # in case Y is zero throughout
# The search takes time with the cube of the rows, and a few determine the kernel as well.
MOST_SEARCHED = 200
# Every combination is a start of the search.
STARTS = ((math.log(0.03), math.log(0.3), math.log(3.0)), (math.log(1e-5), math.log(1e-2)), (0.0,))


@dataclass(frozen=True)
class MaximumLikelihood:
    """The best kernel that was found."""

    kernel: RegressionKernel  # In the units of the data
    value: float  # Its log marginal likelihood, of the rows that were searched
    rows: int  # How many these were


def maximise_likelihood(
    X: FloatArray, Y: FloatArray, linear_bounds: tuple[float, float] = LINEAR_BOUNDS
) -> MaximumLikelihood:
    """The kernel under which Y is most probable, the best of several starts.

    Of more than `MOST_SEARCHED` rows every second is searched, or every third and so on: rows come
    in the order of time, and neighbours that are alike make a kernel too sure of itself.

    Parameters
    ----------
    X : array, shape (n, q)
        Inputs.
    Y : array, shape (n, d)
        Observations, with mean zero.
    linear_bounds : tuple of float
        Bounds of log λ; `NO_LINEAR_TERM` leaves the squared exponential alone.
    """
    step = -(-len(X) // MOST_SEARCHED)
    profile = _Profile(X[::step], Y[::step])
    bounds = (WIDTH_BOUNDS, NOISE_BOUNDS, linear_bounds)
    searches = [
        minimize(profile, np.clip(start, *np.transpose(bounds)), jac=True, bounds=bounds)
        for start in product(*STARTS)
    ]
    best = min(searches, key=lambda search: float(search.fun))
    return MaximumLikelihood(profile.kernel(best.x), -float(best.fun), len(profile.Y))


class _Profile:
    """-log P(Y|X) and its gradient as a function of (log w, log ν, log λ)."""

    def __init__(self, X: FloatArray, Y: FloatArray) -> None:
        self.Y = Y
        squared, products = cdist(X, X, "sqeuclidean"), X @ X.T
        # Rows that are all the same have no length of their own.
        self.distance = float(squared.mean()) or 1.0
        self.product = float(products.diagonal().mean()) or 1.0
        self.D, self.G = squared / self.distance, products / self.product

    def __call__(self, v: FloatArray) -> tuple[float, FloatArray]:
        w, nu, lam = np.exp(v)
        C = squared_exponential(self.D, w)
        R_inverse, log_determinant = self._inverse(C, nu, lam)
        A = R_inverse @ self.Y
        n, d = self.Y.shape
        s = self._scale(A)
        value = 0.5 * (d * log_determinant + n * d * (math.log(s) + 1.0 + math.log(2.0 * math.pi)))
        Gamma = 0.5 * (d * R_inverse - A @ A.T / s)
        Gamma_C = Gamma * C
        gradient = [
            -0.5 * w / (1.0 + lam) * np.sum(Gamma_C * self.D),
            nu * np.trace(Gamma),
            lam / (1.0 + lam) ** 2 * (np.sum(Gamma * self.G) - np.sum(Gamma_C)),
        ]
        return value, np.array(gradient)

    def kernel(self, v: FloatArray) -> RegressionKernel:
        """The kernel in the units of the data, with the best scale."""
        w, nu, lam = np.exp(v).tolist()
        R_inverse, _ = self._inverse(squared_exponential(self.D, w), nu, lam)
        s = self._scale(R_inverse @ self.Y)
        return RegressionKernel(
            variance=s / (1.0 + lam),
            inverse_width=w / self.distance,
            noise=s * nu,
            linear=s * lam / (1.0 + lam) / self.product,
        )

    def _inverse(self, C: FloatArray, nu: float, lam: float) -> tuple[FloatArray, float]:
        """R⁻¹ and log|R|."""
        R = (C + lam * self.G) / (1.0 + lam)
        R[np.diag_indices_from(R)] += nu
        L = cholesky(R, lower=True)
        log_determinant = 2.0 * float(np.log(L.diagonal()).sum())
        return cho_solve((L, True), np.eye(len(R))), log_determinant

    def _scale(self, A: FloatArray) -> float:
        s = float(np.sum(self.Y * A)) / self.Y.size
        return max(s, LEAST_SCALE)
