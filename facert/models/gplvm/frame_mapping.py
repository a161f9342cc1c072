"""Source mapping of a single frame, for streams: Newton's method without a batch around it.

The formulas are those of `facert.models.gplvm.source_mapping`. Where a frame is followed from its
predecessor's z two or three steps lead to the minimum, and what they cost is mostly the calls, not
the arithmetic. So everything that is multiplied by [Tᵀ | α] is one product,

    G [Tᵀ | α] = [H | J],       G = ∂k/∂z,      H = G Tᵀ,       J = ∂μ/∂z,

and J diag(w) Jᵀ - 2 a H Hᵀ and α (w r) - 2 a K⁻¹k are one product each. The latter is the slope of
F in k, and G times it the slope in z. Frames that need more than plain steps, downhill with a
positive definite Hessian, are left to the general method.

G, H and J depend on z alone. So the first step of a frame is taken from where the last one of its
predecessor was: what is known there is used again.
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


class View(NamedTuple):
    """What the source view says at z (q,), whatever is observed.

    Parameters
    ----------
    z : array, shape (q,)
    offsets : array, shape (q, N)
        z - z_i of every position.
    k : array, shape (N,)
    whitened : array, shape (N,)
        T k.
    mean : array, shape (d_x,)
        μ.
    s : float
        σ_p².
    """

    z: FloatArray
    offsets: FloatArray
    k: FloatArray
    whitened: FloatArray
    mean: FloatArray
    s: float


class Stand(NamedTuple):
    """A view with its slopes [H | J], (q, N + d_x): most of the work of a step."""

    view: View
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
    stand : Stand
        Where that was: the next frame can begin there.
    """

    z: FloatArray
    x: FloatArray
    hessian: FloatArray
    energy: float
    stand: Stand


class _Residual(NamedTuple):
    """What a frame says of a view."""

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
        kernel = posterior.kernel
        self._variance, self._noise, self._theta2 = (
            kernel.variance,
            kernel.noise,
            kernel.inverse_width,
        )
        self._Z_T = np.ascontiguousarray(posterior.Z.T)
        self._stacked = posterior.stacked
        self._identity = np.eye(len(self._Z_T))

    def descend(
        self, stand: Stand, b: FloatArray, R: FloatArray, energy: float = math.inf
    ) -> Descent | None:
        """Newton's method for the frame b (d_x,) seen with variance R (d_x,).

        Returns
        -------
        Descent, or None
            None where F is above the energy given to begin with, a step would lead uphill, or the
            Hessian is not positive definite.
        """
        for _ in range(MOST_STEPS):
            value, gradient, hessian = self.expand(stand, b, R)
            if not value <= energy + ROUNDING:
                return None
            energy = value
            _, step, indefinite = dposv(hessian, gradient)
            if indefinite:
                return None
            z = stand.view.z - step
            if float(gradient @ step) < DECREMENT:
                view = self.view(z)
                end = _residual(view, b, R)
                return Descent(z, view.mean - view.s * end.wr, hessian, end.energy, stand)
            stand = self.stand(z)
        return None

    def energy(self, z: FloatArray, b: FloatArray, R: FloatArray) -> float:
        """F(z)."""
        return _residual(self.view(z), b, R).energy

    def expand(
        self, stand: Stand, b: FloatArray, R: FloatArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """F, ∇F (q,) and ∇²F (q, q) of a frame."""
        (z, offsets, k, whitened, _, s), slopes = stand
        n = len(k)
        H, J = slopes[:, :n], slopes[:, n:]
        value, w, wr = _residual(stand.view, b, R)
        w2r = w * wr
        a = 0.5 * (len(b) / s - float(wr @ wr))
        a_slope = float(w2r @ wr) - 0.5 * len(b) / s**2
        ek = (self._stacked @ np.concatenate([-2.0 * a * whitened, wr])) * k
        gradient = z - self._theta2 * (offsets @ ek)

        weights = np.concatenate([np.full(n, -2.0 * a), w])
        g = -2.0 * (H @ whitened)
        # a' g gᵀ - u gᵀ - g uᵀ = v gᵀ + g vᵀ, where u = J (w² r)
        v = (0.5 * a_slope) * g - J @ w2r
        vg = v[:, None] * g
        hessian = (slopes * weights) @ slopes.T
        hessian += (offsets * (self._theta2**2 * ek)) @ offsets.T
        hessian += vg
        hessian += vg.T
        hessian += (1.0 - self._theta2 * float(ek.sum())) * self._identity
        return value, gradient, hessian

    def stand(self, z: FloatArray) -> Stand:
        """The view at z with its slopes."""
        view = self.view(z)
        return Stand(view, (view.offsets * (-self._theta2 * view.k)) @ self._stacked)

    def view(self, z: FloatArray) -> View:
        """The view at z."""
        offsets = z[:, None] - self._Z_T
        k = np.exp(np.einsum("qn,qn->n", offsets, offsets) * (-0.5 * self._theta2))
        k *= self._variance
        product = k @ self._stacked
        whitened, mean = product[: len(k)], product[len(k) :]
        s = self._noise + max(self._variance - float(whitened @ whitened), 0.0)
        return View(z, offsets, k, whitened, mean, s)


def _residual(view: View, b: FloatArray, R: FloatArray) -> _Residual:
    w = 1.0 / (R + view.s)
    r = view.mean - b
    wr = w * r
    energy = float(wr @ r) + len(b) * math.log(view.s) + float(view.z @ view.z)
    return _Residual(0.5 * energy, w, wr)
