"""Source mapping of a single frame, for streams: Newton's method without a batch around it.

The formulas are those of `facert.models.gplvm.source_mapping`, whose batches take twice as long
for a single frame; tests hold the two against each other. Where a frame is followed from its
predecessor's z two or three steps lead to the minimum, and their cost is mostly that of the calls,
not of the arithmetic. So everything that is multiplied by [Tᵀ | α] is one product,

    G [Tᵀ | α] = [H | J],       G = ∂k/∂z,      H = G Tᵀ,       J = ∂μ/∂z,

and J diag(w) Jᵀ - 2 a H Hᵀ and α (w r) - 2 a K⁻¹k are one product each. The latter is the slope of
F in k, and G times it the slope in z. Frames that need more than plain steps, downhill with a
positive definite Hessian, are left to the general method.

G, H and J depend on z alone. So the first step of a frame is taken from where the last one of its
predecessor was, with the view that was linearised there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dposv

from facert.data.arrays import FloatArray
from facert.models.gp.posterior import Predictor

MOST_STEPS = 12
# Newton decrement (nats) below which one more step solves a frame, without another Hessian: what
# that leaves is of the order of its square. The energy is a log-probability.
DECREMENT = 1e-4
# Rounding of the energy, mostly of θ1 - kᵀK⁻¹k against a small noise: not a reason to reject.
ROUNDING = 1e-7


class ViewPoint(NamedTuple):
    """Mean and variance of the source view at z (q,), whatever is observed.

    Parameters
    ----------
    z : array, shape (q,)
    offsets : array, shape (q, N)
        z - z_i of every position.
    squared, k : arrays, shape (N,)
        |z - z_i|², and the kernel there.
    whitened : array, shape (N,)
        T k.
    mean : array, shape (d_x,)
        μ.
    s : float
        σ_p².
    """

    z: FloatArray
    offsets: FloatArray
    squared: FloatArray
    k: FloatArray
    whitened: FloatArray
    mean: FloatArray
    s: float


class LinearisedView(NamedTuple):
    """A point with its slopes [H | J], (q, N + d_x): most of the work of a step."""

    point: ViewPoint
    slopes: FloatArray


class Descent(NamedTuple):
    """Where the search for one frame ended.

    Parameters
    ----------
    z : array, shape (q,)
        z*.
    x : array, shape (d_x,)
        x*.
    hessian : array, shape (q, q)
        ∇²F where the last step, which is tiny, was taken from.
    energy : float
        F(z*).
    linearised : LinearisedView
        The view there: the next frame can begin with it.
    """

    z: FloatArray
    x: FloatArray
    hessian: FloatArray
    energy: float
    linearised: LinearisedView


class _DataTerm(NamedTuple):
    """F of a frame, and its weighted residual."""

    energy: float
    w: FloatArray
    wr: FloatArray


class FrameMapping:
    """Follows single frames in the latent space of a trained source view.

    Parameters
    ----------
    posterior : Predictor
        The source view, X given Z.
    """

    def __init__(self, posterior: Predictor) -> None:
        self._kernel = posterior.kernel
        self._Z_T, self._identity = posterior.Z_T, posterior.identity
        self._stacked = posterior.stacked

    def descend(
        self, at: LinearisedView, b: FloatArray, R: FloatArray, energy: float = math.inf
    ) -> Descent | None:
        """Newton's method for the frame b (d_x,) seen with variance R (d_x,).

        Returns
        -------
        Descent, or None
            None where F is above the energy given to begin with, a step would lead uphill, or the
            Hessian is not positive definite.
        """
        for _ in range(MOST_STEPS):
            value, gradient, hessian = self.expand(at, b, R)
            if not value <= energy + ROUNDING:
                return None
            energy = value
            _, step, indefinite = dposv(hessian, gradient)
            if indefinite:
                return None
            z = at.point.z - step
            if float(gradient @ step) < DECREMENT:
                point = self.point(z)
                end = _data_term(point, b, R)
                return Descent(z, point.mean - point.s * end.wr, hessian, end.energy, at)
            at = self.linearise(z)
        return None

    def energy(self, z: FloatArray, b: FloatArray, R: FloatArray) -> float:
        """F(z)."""
        return _data_term(self.point(z), b, R).energy

    def expand(
        self, at: LinearisedView, b: FloatArray, R: FloatArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """F, ∇F (q,) and ∇²F (q, q) of a frame."""
        (z, offsets, squared, k, whitened, _, s), slopes = at
        n = len(k)
        H, J = slopes[:, :n], slopes[:, n:]
        value, w, wr = _data_term(at.point, b, R)
        w2r = w * wr
        a = 0.5 * (len(b) / s - float(wr @ wr))
        a_slope = float(w2r @ wr) - 0.5 * len(b) / s**2
        ek = (self._stacked @ np.concatenate([-2.0 * a * whitened, wr])) * k
        ek_slopes = ek * (2.0 * self._kernel.relative_slope(squared))
        gradient = z + offsets @ ek_slopes

        weights = np.concatenate([np.full(n, -2.0 * a), w])
        g = -2.0 * (H @ whitened)
        # a' g gᵀ - u gᵀ - g uᵀ = v gᵀ + g vᵀ, where u = J (w² r)
        v = (0.5 * a_slope) * g - J @ w2r
        vg = v[:, None] * g
        hessian = (slopes * weights) @ slopes.T
        hessian += (offsets * (ek * (4.0 * self._kernel.relative_curvature(squared)))) @ offsets.T
        hessian += vg
        hessian += vg.T
        hessian += (1.0 + float(ek_slopes.sum())) * self._identity
        return value, gradient, hessian

    def linearise(self, z: FloatArray) -> LinearisedView:
        """The view at z with its slopes."""
        at = self.point(z)
        G = at.offsets * (at.k * (2.0 * self._kernel.relative_slope(at.squared)))
        return LinearisedView(at, G @ self._stacked)

    def point(self, z: FloatArray) -> ViewPoint:
        """The view at z."""
        kernel, offsets = self._kernel, z[:, None] - self._Z_T
        squared = np.einsum("qn,qn->n", offsets, offsets)
        k = kernel.value(squared)
        product = k @ self._stacked
        whitened, mean = product[: len(k)], product[len(k) :]  # Eq. (16)
        s = kernel.noise + max(kernel.variance - float(whitened @ whitened), 0.0)  # Eq. (17)
        return ViewPoint(z, offsets, squared, k, whitened, mean, s)


def _data_term(at: ViewPoint, b: FloatArray, R: FloatArray) -> _DataTerm:
    w = 1.0 / (R + at.s)
    r = at.mean - b
    wr = w * r
    energy = float(wr @ r) + len(b) * math.log(at.s) + float(at.z @ at.z)
    return _DataTerm(0.5 * energy, w, wr)
