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
from facert.models.gplvm.source_mapping import (
    DECREMENT,
    ROUNDING,
    LinearisedView,
    Mapped,
    Observation,
    SourceMapping,
    ViewPoint,
)

MOST_STEPS = 12


class _DataTerm(NamedTuple):
    """The data term of F for a frame, and its weighted residual."""

    energy: float
    w: FloatArray
    wr: FloatArray


class FrameMapping(SourceMapping):
    """Source mapping that follows single frames as well.

    Parameters
    ----------
    view : Predictor
        The source view, X given Z, not on a device: single frames are soon done.
    """

    def follow(
        self,
        observed: Observation,
        previous: FloatArray,
        linearised: LinearisedView | None = None,
    ) -> Mapped:
        """Minimise F for one frame, beginning at the predecessor's z or the best training latent.

        Parameters
        ----------
        observed : Observation
            One frame.
        previous : array, shape (1, q)
            z of the frame before.
        linearised : LinearisedView, optional
            `Mapped.linearised` of that frame, as good as its z and quicker.
        """
        b, R = observed.mean[0], observed.variance[0]
        (energies,) = self._train_energies(observed.mean, observed.variance)
        least = energies.argmin()
        at = linearised or self.linearise(previous[0])
        found = self.descend(at, b, R, float(energies[least]))
        if found is None:
            nearest = self.view.Z[least]
            if self.frame_energy(nearest, b, R) < self.frame_energy(at.point.z, b, R):
                at = self.linearise(nearest)
            found = self.descend(at, b, R)
        return self.solve(observed, previous) if found is None else found

    def descend(
        self, at: LinearisedView, b: FloatArray, R: FloatArray, energy: float = math.inf
    ) -> Mapped | None:
        """Newton's method for the frame b (d_x,) seen with variance R (d_x,).

        Returns
        -------
        Mapped, or None
            None where F is above the energy given to begin with, a step would lead uphill, or the
            Hessian is not positive definite.
        """
        for _ in range(MOST_STEPS):
            value, gradient, hessian = self.expand_frame(at, b, R)
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
                x = point.mean - point.s * end.wr
                energies, yes = np.array([end.energy]), np.array([True])
                return Mapped(z[None], x[None], hessian[None], energies, yes, at)
            at = self.linearise(z)
        return None

    def frame_energy(self, z: FloatArray, b: FloatArray, R: FloatArray) -> float:
        """The energy F(z) of a frame b (d_x,) seen with variance R (d_x,)."""
        return _data_term(self.point(z), b, R).energy

    def expand_frame(
        self, at: LinearisedView, b: FloatArray, R: FloatArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """F, ∇F (q,) and ∇²F (q, q) of a frame."""
        (z, offsets, squared, k, whitened, _, s), slopes = at
        kernel = self.view.kernel
        n = len(k)
        H, J = slopes[:, :n], slopes[:, n:]
        value, w, wr = _data_term(at.point, b, R)
        w2r = w * wr
        a = 0.5 * (len(b) / s - float(wr @ wr))
        a_slope = float(w2r @ wr) - 0.5 * len(b) / s**2
        ek = (self.view.stacked @ np.concatenate([-2.0 * a * whitened, wr])) * k
        ek_slopes = ek * (2.0 * kernel.relative_slope(squared))
        gradient = z + offsets @ ek_slopes

        weights = np.concatenate([np.full(n, -2.0 * a), w])
        g = -2.0 * (H @ whitened)
        # a' g gᵀ - u gᵀ - g uᵀ = v gᵀ + g vᵀ, where u = J (w² r)
        v = (0.5 * a_slope) * g - J @ w2r
        vg = v[:, None] * g
        hessian = (slopes * weights) @ slopes.T
        hessian += (offsets * (ek * (4.0 * kernel.relative_curvature(squared)))) @ offsets.T
        hessian += vg
        hessian += vg.T
        hessian += (1.0 + float(ek_slopes.sum())) * self.view.identity
        return value, gradient, hessian

    def linearise(self, z: FloatArray) -> LinearisedView:
        """The view at z with its slopes."""
        at = self.point(z)
        G = at.offsets * (at.k * (2.0 * self.view.kernel.relative_slope(at.squared)))
        return LinearisedView(at, G @ self.view.stacked)

    def point(self, z: FloatArray) -> ViewPoint:
        """The view at z."""
        kernel, offsets = self.view.kernel, z[:, None] - self.view.Z_T
        squared = np.einsum("qn,qn->n", offsets, offsets)
        k = kernel.value(squared)
        product = k @ self.view.stacked
        whitened, mean = product[: len(k)], product[len(k) :]  # Eq. (16)
        s = kernel.noise + max(kernel.variance - float(whitened @ whitened), 0.0)  # Eq. (17)
        return ViewPoint(z, offsets, squared, k, whitened, mean, s)


def _data_term(at: ViewPoint, b: FloatArray, R: FloatArray) -> _DataTerm:
    w = 1.0 / (R + at.s)
    r = at.mean - b
    wr = w * r
    energy = float(wr @ r) + len(b) * math.log(at.s) + float(at.z @ at.z)
    return _DataTerm(0.5 * energy, w, wr)
