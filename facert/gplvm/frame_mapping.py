"""Source mapping of a single frame, for streams: Newton's method without a batch around it.

The formulas are those of `facert.gplvm.source_mapping`. Where a frame is followed from its
predecessor's z two or three steps lead to the minimum, and what they cost is mostly the calls, not
the arithmetic. So everything that is multiplied by [Tᵀ | α] is one product,

    G [Tᵀ | α] = [H | J],       G = ∂k/∂z,      H = G Tᵀ,       J = ∂μ/∂z,

and J diag(w) Jᵀ - 2 a H Hᵀ and α (w r) - 2 a K⁻¹k are one product each. Frames that need more than
plain steps, downhill with a positive definite Hessian, are left to the general method.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dposv

from facert.data import FloatArray
from facert.gp.posterior import Predictor

MOST_STEPS = 12
# Newton decrement (nats) below which one more step solves a frame, without another Hessian: what
# that leaves is of the order of its square. The energy is a log-probability.
DECREMENT = 1e-4
# Rounding of the energy, mostly of θ1 - kᵀK⁻¹k against a small noise: not a reason to reject.
ROUNDING = 1e-7


@dataclass(frozen=True, slots=True)
class Descent:
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
    """

    z: FloatArray
    x: FloatArray
    hessian: FloatArray
    energy: float


@dataclass(frozen=True, slots=True)
class _Point:
    """What the source view says at z, and what a frame says of that."""

    energy: float
    s: float
    mean: FloatArray
    whitened: FloatArray
    w: FloatArray
    wr: FloatArray

    @property
    def x(self) -> FloatArray:
        """x*(z), (d_x,)."""
        return self.mean - self.s * self.wr


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
        self, z: FloatArray, b: FloatArray, R: FloatArray, energy: float = math.inf
    ) -> Descent | None:
        """Newton's method from z (q,) for the frame b (d_x,) seen with variance R (d_x,).

        Returns
        -------
        Descent, or None
            None where F(z) is above the energy given, a step would lead uphill, or the Hessian is
            not positive definite.
        """
        for _ in range(MOST_STEPS):
            at, gradient, hessian = self.expand(z, b, R)
            if not at.energy <= energy + ROUNDING:
                return None
            energy = at.energy
            _, step, indefinite = dposv(hessian, gradient)
            if indefinite:
                return None
            z = z - step
            if float(gradient @ step) < DECREMENT:
                end, *_ = self._look(z, b, R)
                return Descent(z, end.x, hessian, end.energy)
        return None

    def energy(self, z: FloatArray, b: FloatArray, R: FloatArray) -> float:
        """F(z)."""
        return self._look(z, b, R)[0].energy

    def expand(
        self, z: FloatArray, b: FloatArray, R: FloatArray
    ) -> tuple[_Point, FloatArray, FloatArray]:
        """The point z, ∇F (q,) and ∇²F (q, q)."""
        at, offsets, k = self._look(z, b, R)
        n = len(k)
        product = (offsets * (-self._theta2 * k)) @ self._stacked
        H, J = product[:, :n], product[:, n:]
        s, w, wr = at.s, at.w, at.wr
        w2r = w * wr
        a = 0.5 * (len(b) / s - float(wr @ wr))
        a_slope = float(w2r @ wr) - 0.5 * len(b) / s**2
        g = -2.0 * (H @ at.whitened)
        u = J @ w2r
        gradient = J @ wr + a * g + z

        weights = np.concatenate([np.full(n, -2.0 * a), w])
        ek = (self._stacked @ np.concatenate([-2.0 * a * at.whitened, wr])) * k
        # a' g gᵀ - u gᵀ - g uᵀ = v gᵀ + g vᵀ
        v = (0.5 * a_slope) * g - u
        vg = v[:, None] * g
        hessian = (product * weights) @ product.T
        hessian += (offsets * (self._theta2**2 * ek)) @ offsets.T
        hessian += vg
        hessian += vg.T
        hessian += (1.0 - self._theta2 * float(ek.sum())) * self._identity
        return at, gradient, hessian

    def _look(
        self, z: FloatArray, b: FloatArray, R: FloatArray
    ) -> tuple[_Point, FloatArray, FloatArray]:
        """The point z, z - z_i of every position (q, N), and k (N,)."""
        offsets = z[:, None] - self._Z_T
        k = np.exp(np.einsum("qn,qn->n", offsets, offsets) * (-0.5 * self._theta2))
        k *= self._variance
        product = k @ self._stacked
        whitened, mean = product[: len(k)], product[len(k) :]
        s = self._noise + max(self._variance - float(whitened @ whitened), 0.0)
        w = 1.0 / (R + s)
        r = mean - b
        wr = w * r
        energy = 0.5 * (float(wr @ r) + len(b) * math.log(s) + float(z @ z))
        return _Point(energy, s, mean, whitened, w, wr), offsets, k
