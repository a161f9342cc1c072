"""Source mapping: the latent position and the cleaned source of an observed frame, Eqs. (9)-(17).

For one frame, with x̃ observed with variance R_d per dimension (infinite where nothing was seen,
and including the previous frame's pull, Eq. 14), the paper minimises over x and z

    Σ_d (x_d - b_d)²/(2 R_d) + |x - μ(z)|²/(2 σ_p²(z)) + d_x/2 log σ_p²(z) + |z|²/2.

It is quadratic in x, whose minimum x* = μ - σ_p² w ∘ (μ - b) with w_d = 1/(σ_p² + R_d) leaves

    F(z) = 1/2 Σ_d w_d (μ_d - b_d)² + d_x/2 log σ_p² + |z|²/2,

a problem in q dimensions. `solve` runs Newton's method with the exact Hessian on many frames at
once; for one after its predecessor see `facert.models.gplvm.frame_mapping`. Writing r = μ - b,
s = σ_p², J = ∂μ/∂z, g = ∂s/∂z = -2 G K⁻¹ k and a = ∂F/∂s = -1/2 Σ w² r² + d_x/(2s), a' = ∂a/∂s
= Σ w³ r² - d_x/(2s²):

    ∇F  = J (w r) + a g + z
    ∇²F = J diag(w) Jᵀ + a' g gᵀ - u gᵀ - g uᵀ - 2 a G K⁻¹ Gᵀ + Σ_i e_i ∇²k_i + I,

where u = J (w² r) and e = α (w r) - 2 a K⁻¹ k, the slope of F in k, collects the curvature of the
kernel itself, ∇²k_i = 2 k'_i I + 4 k''_i (z - z_i)(z - z_i)ᵀ.

The view may be on a torch device: thousands of frames go over at once, F with its q derivatives
comes back, and Newton's steps, in q dimensions, stay here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.models.gp.posterior import PosteriorPoint, Predictor, namespace

MAX_ITERATIONS = 200  # in all; most frames need three or four
# Newton decrement (nats) below which one more step solves a frame, without another Hessian: what
# that leaves is of the order of its square. The energy is a log-probability.
DECREMENT = 1e-4
# Rounding of the energy, mostly of θ1 - kᵀK⁻¹k against a small noise: not a reason to reject.
ROUNDING = 1e-7
SHIFTED_DECREMENT = 1e-9  # a shifted step predicts little, however much is left
FLAT = 1e-12  # share of the largest curvature: the sign of less is rounding
SHIFT = 1e-3  # first shift after a rejected step, relative to the largest curvature
# Frames solved together; bounds the memory at about 2 CHUNK q (N + d_x) doubles, the device's too.
CHUNK, DEVICE_CHUNK = 128, 4096


def chunks_of(frames: int, view: Predictor) -> Iterator[slice]:
    """Slices of frames that are computed together."""
    size = CHUNK if view.device is None else DEVICE_CHUNK
    return (slice(first, first + size) for first in range(0, frames, size))


@dataclass(frozen=True)
class Observation:
    """The observed source at B frames, in normalised units."""

    mean: FloatArray  # (B, d_x): b, finite everywhere
    variance: FloatArray  # (B, d_x): R, its variance; infinite where nothing is known

    @classmethod
    def of(
        cls, X: FloatArray, sigma_c: float, input_variance: FloatArray | None = None
    ) -> Observation:
        """Frames (B, d_x) with measurement noise sigma_c, Eq. (13); NaN: not observed.

        Numbers that were not measured but filled in have so much variance more, `input_variance`
        (B, d_x).
        """
        seen = ~np.isnan(X)
        variance = sigma_c**2 + (0.0 if input_variance is None else np.nan_to_num(input_variance))
        return cls(np.where(seen, X, 0.0), np.where(seen, variance, np.inf))

    def following(self, previous: FloatArray, sigma_t: float) -> Observation:
        """Observation with the pull of the previous cleaned frame, (B, d_x), added: Eq. (14)."""
        precision = 1.0 / self.variance
        total = precision + sigma_t**-2
        mean = (precision * self.mean + sigma_t**-2 * previous) / total
        return Observation(mean, 1.0 / total)

    def __getitem__(self, rows: slice | FloatArray) -> Observation:
        """The observation of some of the frames."""
        return Observation(self.mean[rows], self.variance[rows])


class ViewPoint(NamedTuple):
    """Mean and variance of the source view at z (q,), whatever is observed."""

    z: FloatArray  # (q,)
    offsets: FloatArray  # (q, N): z - z_i of every position
    # (N,): |z - z_i|², and the kernel there
    squared: FloatArray
    k: FloatArray
    whitened: FloatArray  # (N,): T k
    mean: FloatArray  # (d_x,): μ
    s: float  # σ_p²


class LinearisedView(NamedTuple):
    """A point with its slopes [H | J], (q, N + d_x): most of the work of a step."""

    point: ViewPoint
    slopes: FloatArray


@dataclass(frozen=True)
class Mapped:
    """Frames in latent space."""

    z: FloatArray  # (B, q): z*, the latent positions
    x: FloatArray  # (B, d_x): x*, the most probable source
    # (B, q, q): ∇²F at z*, or a tiny last step before; its inverse is the covariance of z in the
    # Laplace approximation
    hessian: FloatArray
    energy: FloatArray  # (B,): F(z*)
    converged: BoolArray  # (B,): Whether Newton's method met its tolerance
    # Where the last step of a single followed frame was taken from
    linearised: LinearisedView | None = None


@dataclass(frozen=True)
class Expansion:
    """F and its derivatives at B latent positions."""

    energy: FloatArray
    gradient: FloatArray
    hessian: FloatArray


class SourceMapping:
    """Maps observed frames to the latent space of a trained source view.

    Parameters
    ----------
    view : Predictor
        The source view, X given Z, perhaps on a device.
    """

    def __init__(self, view: Predictor) -> None:
        self.view = view
        # The search for a start takes F at every training latent: compute once what is constant.
        at, xp = view.predict(view.Z), namespace(view.Z)
        self._train_variance = float(at.variance.mean())  # it varies little, and serves all
        self._train_means = xp.concatenate([0.5 * at.mean**2, -at.mean], axis=1).T
        self._train_energy: FloatArray = 0.5 * (
            view.columns * xp.log(at.variance) + (view.Z**2).sum(1)
        )

    def start(self, observed: Observation) -> FloatArray:
        """The training latent of least energy for each frame, (B, q)."""
        b, R = self.view.there(observed.mean), self.view.there(observed.variance)
        return self.view.here(self.view.Z[self._train_energies(b, R).argmin(1)])

    def _train_energies(self, b: FloatArray, R: FloatArray) -> FloatArray:
        """Approximate F at the training latents, (B, N)."""
        xp = namespace(b)
        w = 1.0 / (self._train_variance + R)
        wb = w * b
        of_frame: FloatArray = 0.5 * xp.einsum("bd,bd->b", wb, b)
        of_both: FloatArray = xp.concatenate([w, wb], axis=1) @ self._train_means
        return of_both + self._train_energy + of_frame[:, None]

    def energy(self, z: FloatArray, observed: Observation) -> FloatArray:
        """F(z) for B frames, (B,)."""
        return self._look(z, observed)[0]

    def solve(self, observed: Observation, *starts: FloatArray) -> Mapped:
        """Minimise F for each frame on its own, beginning at the best of the starts.

        Parameters
        ----------
        observed : Observation
            B frames.
        *starts : array, shape (B, q)
            Candidates beside the best training latent, e.g. the previous frame's z.

        Returns
        -------
        Mapped
            All frames; solved in chunks, so that memory stays bounded.
        """
        slices = list(chunks_of(len(observed.mean), self.view))
        scratch = self._scratch(observed[slices[0]])
        chunks = [
            self._newton(observed[rows], [start[rows] for start in starts], scratch)
            for rows in slices
        ]
        if len(chunks) == 1:
            return chunks[0]
        names = ("z", "x", "hessian", "energy", "converged")
        z, x, hessian, energy, converged = (
            np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in names
        )
        return Mapped(z, x, hessian, energy, converged)

    def _scratch(self, observed: Observation) -> FloatArray | None:
        """Memory for the largest product of a chunk; a device has its own."""
        if self.view.device is not None:
            return None
        rows = len(observed.mean) * self.view.Z.shape[1]
        return np.empty((rows, self.view.stacked.shape[1]))

    def _newton(
        self, observed: Observation, starts: list[FloatArray], scratch: FloatArray | None
    ) -> Mapped:
        """Newton's method; a shift appears only where a step is rejected, see `_step`."""
        z = self._best_start(observed, starts)
        at = self._expand(z, observed, scratch)
        energy, gradient, hessian = at.energy, at.gradient, at.hessian
        shift, last = np.zeros(len(z)), np.zeros_like(z)
        converged = np.zeros(len(z), dtype=bool)

        active = np.arange(len(z))
        for _ in range(MAX_ITERATIONS):
            step = _step(hessian[active], gradient[active], shift[active])
            descent = np.einsum("bq,bq->b", gradient[active], step)
            done = np.abs(descent) < np.where(shift[active] > 0.0, SHIFTED_DECREMENT, DECREMENT)
            done[done] = ~_leave_saddles(hessian[active], step, descent, done)
            converged[active[done]], last[active[done]] = True, step[done]
            active, step, descent = active[~done], step[~done], descent[~done]
            if not len(active):
                break
            at = self._expand(z[active] + step, observed[active], scratch)
            fall = energy[active] - at.energy
            predicted = -descent - 0.5 * np.einsum("bp,bpq,bq->b", step, hessian[active], step)
            better = (descent < 0.0) & (fall >= -ROUNDING)
            good = active[better]
            z[good] += step[better]
            energy[good], gradient[good] = at.energy[better], at.gradient[better]
            hessian[good] = at.hessian[better]
            shift[active] = _adapted(shift[active], better, fall, predicted)
        end, x = self._look(z + last, observed)
        return Mapped(z + last, x, hessian, end, converged)

    def _look(self, z: FloatArray, observed: Observation) -> tuple[FloatArray, FloatArray]:
        """F and x* at z (B, q)."""
        view = self.view
        z, b, R = (view.there(array) for array in (z, observed.mean, observed.variance))
        at = view.predict(z)
        w, r = 1.0 / (at.variance[:, None] + R), at.mean - b
        x = at.mean - at.variance[:, None] * w * r
        return view.here(_energy(z, at, w, r)), view.here(x)

    def _best_start(self, observed: Observation, starts: list[FloatArray]) -> FloatArray:
        z = self.start(observed)
        if not starts:
            return z
        candidates = np.stack([z, *starts])
        energies = np.stack([self.energy(candidate, observed) for candidate in candidates])
        return np.asarray(candidates[energies.argmin(axis=0), np.arange(len(z))])

    def _expand(
        self, z: FloatArray, observed: Observation, scratch: FloatArray | None = None
    ) -> Expansion:
        """F, ∇F and ∇²F at z (B, q), by the formulas at the head of this file."""
        view = self.view
        z, b, R = (view.there(array) for array in (z, observed.mean, observed.variance))
        kernel, d_x, einsum = view.kernel, view.columns, namespace(z).einsum
        at = view.predict(z)
        _, H, J = view.jacobians(at, scratch)

        s = at.variance
        w, r = 1.0 / (s[:, None] + R), at.mean - b
        wr = w * r
        w2r = w * wr
        a = -0.5 * einsum("bd,bd->b", wr, wr) + 0.5 * d_x / s
        a_slope = einsum("bd,bd->b", w2r, wr) - 0.5 * d_x / s**2
        g = -2.0 * einsum("bqn,bn->bq", H, at.whitened)
        u = einsum("bqd,bd->bq", J, w2r)
        gradient = einsum("bqd,bd->bq", J, wr) + a[:, None] * g + z

        ek = (wr @ view.alpha.T - 2.0 * a[:, None] * view.solve(at)) * at.k
        slopes = ek * (2.0 * kernel.relative_slope(at.squared))
        curvatures = ek * (4.0 * kernel.relative_curvature(at.squared))
        ug = u[:, :, None] * g[:, None, :]
        hessian = (
            (J * w[:, None, :]) @ J.mT
            + a_slope[:, None, None] * g[:, :, None] * g[:, None, :]
            - (ug + ug.mT)
            - (2.0 * a)[:, None, None] * (H @ H.mT)
            + (at.offsets * curvatures[:, None, :]) @ at.offsets.mT
            + (1.0 + slopes.sum(1))[:, None, None] * view.identity
        )
        return Expansion(*(view.here(array) for array in (_energy(z, at, w, r), gradient, hessian)))


def _leave_saddles(
    hessian: FloatArray, step: FloatArray, descent: FloatArray, done: BoolArray
) -> BoolArray:
    """Mask of converged frames at a saddle point; their steps are set to lead off it."""
    try:
        np.linalg.cholesky(hessian[done])
        return np.zeros(np.count_nonzero(done), dtype=bool)
    except np.linalg.LinAlgError:
        pass  # one at least: look at all
    values, vectors = np.linalg.eigh(hessian[done])
    saddle = values[:, 0] < -FLAT * values[:, -1]
    rows = np.flatnonzero(done)[saddle]
    # A fall of about 0.005 nats along the direction of negative curvature.
    length = 0.1 / np.sqrt(-values[saddle, 0])
    step[rows] = length[:, None] * vectors[saddle, :, 0]
    descent[rows] = -DECREMENT
    return saddle


def _adapted(
    shift: FloatArray, better: BoolArray, fall: FloatArray, predicted: FloatArray
) -> FloatArray:
    """The next shift: smaller where the quadratic model predicted the fall well, larger where not.

    In a narrow curved valley a step may be better and yet far from what was predicted.
    """
    poor = ~better | (fall < 0.25 * predicted - ROUNDING)
    well = better & (fall > 0.75 * predicted - ROUNDING)
    raised = np.maximum(4.0 * shift, SHIFT)
    lowered = np.where(shift > SHIFT, 0.25 * shift, 0.0)
    return np.where(poor, raised, np.where(well, lowered, shift))


def _step(hessian: FloatArray, gradient: FloatArray, shift: FloatArray) -> FloatArray:
    """Newton's step -H⁻¹ g, (B, q); with a shift, -(|H| + shift h)⁻¹ g.

    |H| has the eigenvalues' absolute values, so that the shifted step descends from a saddle as
    well; h is the largest of them.
    """
    step: FloatArray = np.negative(np.linalg.solve(hessian, gradient[:, :, None])[:, :, 0])
    shifted = np.flatnonzero(shift)
    if len(shifted):
        values, vectors = np.linalg.eigh(hessian[shifted])
        values = np.abs(values)
        values += shift[shifted, None] * values.max(axis=1, keepdims=True)
        along = np.einsum("bqk,bq->bk", vectors, gradient[shifted]) / values
        step[shifted] = -np.einsum("bqk,bk->bq", vectors, along)
    return step


def _energy(z: FloatArray, at: PosteriorPoint, w: FloatArray, r: FloatArray) -> FloatArray:
    """F of B frames, (B,)."""
    xp = namespace(z)
    squares = xp.einsum("bd,bd,bd->b", w, r, r) + xp.einsum("bq,bq->b", z, z)
    energy: FloatArray = 0.5 * (squares + r.shape[1] * xp.log(at.variance))
    return energy
