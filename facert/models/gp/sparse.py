"""The Gaussian process likelihood through a few inducing positions, at a cost linear in the rows.

m positions U stand for the n rows: with Q = K_nm K_mm⁻¹ K_mn, K_mm the kernel among them and K_mn
that between them and the rows, every column of X is drawn from N(0, Q + Λ), Λ diagonal.

* `VFE`, the collapsed variational bound (Titsias 2009): Λ = s I, s the noise, and d/(2 s) tr(K - Q)
  is added. The result is never below the exact value, and more positions never make it worse.
* `FITC` (Snelson and Ghahramani 2006): Λ = diag(K - Q) + s I, so that the variance of each row is
  right. The diagonal then does the work of the noise, which the likelihood takes to zero where it
  can (see `facert.models.kernels` for what that does): FITC is for use with a noise floor, as the
  shared models always have one.

A row may have a weight w and then counts as w rows that are alike; Λ is divided by it. With the
factors L Lᵀ = K_mm, V = L⁻¹ K_mn, A = V Λ^-½ and B = I + A Aᵀ an evaluation costs O(n m²). For
F Fᵀ = X Xᵀ, f = -log P and G = ∂f/∂Q the gradient follows from

    ∂f/∂K_mn = 2 P G,      ∂f/∂K_mm = -P G Pᵀ,      P = K_mm⁻¹ K_mn = L⁻ᵀ V,
    P G = L⁻ᵀ (d/2 B⁻¹ A Λ^-½ - V diag(g)) - E Wᵀ/2,
    W = (Q + Λ)⁻¹ F = Λ^-½ (I - Aᵀ B⁻¹ A) Λ^-½ F,      E = P W = L⁻ᵀ B⁻¹ A Λ^-½ F,

where g is the slope of f along the diagonal of K - Q: d w/(2 s) for VFE, and for FITC what
h = (d diag (Q + Λ)⁻¹ - |W_i|²)/2, the slope along Λ, says of it. No matrix has n² entries.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, Protocol

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from facert.models.gp.cholesky import cholesky

ApproximationName = Literal["vfe", "fitc"]
# Variance of the inducing values themselves beside θ1, relative to it, without which K_mm would be
# singular. A bound remains a bound, as if the values were seen through so much noise.
JITTER = 1e-10


@dataclass(frozen=True)
class Missed:
    """What the inducing positions miss of the rows, and what a row weighs.

    Parameters
    ----------
    variance : Tensor, shape (n,)
        The diagonal of K - Q.
    weights : Tensor, shape (n,)
        w.
    noise : float
        s.
    columns : int
        d.
    """

    variance: Tensor
    weights: Tensor
    noise: float
    columns: int

    def repeats(self, variance: Tensor) -> Tensor:
        """What w rows that are alike, of such variances (n,), have beside one of variance / w."""
        logs = (self.weights - 1.0) * (2.0 * math.pi * variance).log() + self.weights.log()
        return 0.5 * self.columns * logs.sum()


class Approximation(Protocol):
    """How it is dealt with what the inducing positions miss."""

    def diagonal(self, missed: Missed) -> Tensor:
        """Λ, (n,)."""
        ...

    def penalty(self, missed: Missed) -> Tensor:
        """What the value has beside -log N(0, Q + Λ), a scalar."""
        ...

    def slopes(self, h: Tensor, missed: Missed) -> tuple[Tensor, Tensor]:
        """Of the value along the diagonal of K - Q, (n,), and along the noise.

        `h` (n,) is the slope of -log N(0, Q + Λ) along Λ.
        """
        ...


class VFE:
    """The collapsed variational bound."""

    def diagonal(self, missed: Missed) -> Tensor:
        """The noise alone."""
        return missed.noise / missed.weights

    def penalty(self, missed: Missed) -> Tensor:
        """The bound's trace term."""
        trace = (missed.weights * missed.variance).sum()
        repeats = missed.repeats(torch.full_like(missed.variance, missed.noise))
        return 0.5 * missed.columns / missed.noise * trace + repeats

    def slopes(self, h: Tensor, missed: Missed) -> tuple[Tensor, Tensor]:
        """The trace term's along K - Q; the noise is in Λ, in the trace term and in the repeats."""
        w, s = missed.weights, missed.noise
        along = 0.5 * missed.columns / s * w
        rest = 0.5 * missed.columns / s * (w - 1.0) - along * missed.variance / s
        return along, (h / w + rest).sum()


class FITC:
    """The fully independent training conditional."""

    def diagonal(self, missed: Missed) -> Tensor:
        """The noise and what is missed."""
        return (missed.variance + missed.noise) / missed.weights

    def penalty(self, missed: Missed) -> Tensor:
        """Nothing but for repeated rows."""
        return missed.repeats(missed.variance + missed.noise)

    def slopes(self, h: Tensor, missed: Missed) -> tuple[Tensor, Tensor]:
        """The noise adds to what is missed: their slopes are alike."""
        w, v = missed.weights, missed.variance + missed.noise
        along = h / w + 0.5 * missed.columns * (w - 1.0) / v
        return along, along.sum()


APPROXIMATIONS: Mapping[ApproximationName, Approximation] = MappingProxyType(
    {"vfe": VFE(), "fitc": FITC()}
)


@dataclass(frozen=True)
class Factors:
    """The factors at the head of this file.

    Parameters
    ----------
    L_inverse : Tensor, shape (m, m)
    V, A : Tensor, shape (m, n)
    B_cholesky : Tensor, shape (m, m)
        Lower factor of B.
    diagonal : Tensor, shape (n,)
        Λ.
    missed : Missed
    """

    L_inverse: Tensor
    V: Tensor
    A: Tensor
    B_cholesky: Tensor
    diagonal: Tensor
    missed: Missed


def factorise(
    K_mm: Tensor,
    K_mn: Tensor,
    weights: Tensor,
    variance: float,
    noise: float,
    columns: int,
    approximation: Approximation,
) -> Factors:
    """What value, gradient and posterior are made from.

    Parameters
    ----------
    K_mm, K_mn : Tensor, shapes (m, m) and (m, n)
        Without noise and jitter.
    weights : Tensor, shape (n,)
    variance, noise : float
        θ1 and θ3⁻¹.
    columns : int
        d.
    approximation : Approximation

    Raises
    ------
    NumericalError
        When K_mm or B is not positive definite within the jitter ladder.
    """
    identity = torch.eye(len(K_mm)).to(K_mm)
    L = cholesky(K_mm + JITTER * variance * identity)
    L_inverse = torch.linalg.solve_triangular(L, identity, upper=False)
    V = L_inverse @ K_mn
    left = (variance - V.square().sum(0)).clamp_(min=0.0)
    missed = Missed(left, weights, noise, columns)
    diagonal = approximation.diagonal(missed)
    A = V * diagonal.rsqrt()
    return Factors(L_inverse, V, A, cholesky(torch.addmm(identity, A, A.T)), diagonal, missed)


class _SparseNegativeLogLikelihood(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        Z: Tensor,
        U: Tensor,
        log_kernel: Tensor,
        F: Tensor,
        weights: Tensor,
        columns: int,
        noise_floor: float,
        approximation: Approximation,
    ) -> Tensor:
        """The value; the gradient is computed beside it, and kept for `backward`."""
        theta1, theta2, excess = log_kernel.exp().tolist()
        noise = excess + noise_floor
        K_mm, K_mn = (_smooth_kernel(U, other, theta1, theta2) for other in (U, Z))
        parts = factorise(K_mm, K_mn, weights, theta1, noise, columns, approximation)
        value, slopes = _value_and_slopes(parts, F, approximation)

        T_mn, T_mm = K_mn.mul_(slopes.K_mn), K_mm.mul_(slopes.K_mm)
        dZ = -theta2 * (T_mn.sum(0)[:, None] * Z - T_mn.T @ U)
        dU = -theta2 * (T_mn.sum(1)[:, None] * U - T_mn @ Z)
        dU -= 2.0 * theta2 * (T_mm.sum(1)[:, None] * U - T_mm @ U)
        diagonals = theta1 * (slopes.missed.sum() + JITTER * slopes.K_mm.trace())
        d_log_kernel = torch.stack(
            [
                T_mn.sum() + T_mm.sum() + diagonals,
                0.5 * ((Z * dZ).sum() + (U * dU).sum()),
                excess * slopes.noise,
            ]
        )
        ctx.save_for_backward(dZ, dU, d_log_kernel)
        return value

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, upstream: Tensor) -> tuple[Tensor | None, ...]:
        gradients = (upstream * gradient for gradient in ctx.saved_tensors)
        return *gradients, None, None, None, None, None


@dataclass(frozen=True)
class _Slopes:
    """Of the value along K_mn (m, n), K_mm (m, m), diag(K - Q) (n,) and the noise."""

    K_mn: Tensor
    K_mm: Tensor
    missed: Tensor
    noise: Tensor


def _smooth_kernel(U: Tensor, Z: Tensor, theta1: float, theta2: float) -> Tensor:
    """θ1 exp(-θ2/2 |u_i - z_j|²), (m, n)."""
    squared = U.square().sum(1)[:, None] + Z.square().sum(1)
    K = torch.addmm(squared, U, Z.T, alpha=-2.0).clamp_(min=0.0)
    return K.mul_(-0.5 * theta2).exp_().mul_(theta1)


def _value_and_slopes(
    parts: Factors, F: Tensor, approximation: Approximation
) -> tuple[Tensor, _Slopes]:
    root, columns = parts.diagonal.rsqrt(), parts.missed.columns
    scaled = F * root[:, None]
    AF = parts.A @ scaled
    explained = torch.cholesky_solve(AF, parts.B_cholesky)  # B⁻¹ A Λ^-½ F
    log_determinant = (2.0 * math.pi * parts.diagonal).log().sum()
    log_determinant += 2.0 * parts.B_cholesky.diagonal().log().sum()
    data = scaled.square().sum() - (AF * explained).sum()
    penalty = approximation.penalty(parts.missed)
    value = 0.5 * (columns * log_determinant + data) + penalty

    R = torch.cholesky_inverse(parts.B_cholesky) @ parts.A  # B⁻¹ A
    W = torch.addmm(scaled, parts.A.T, explained, alpha=-1.0).mul_(root[:, None])
    precision = root.square() * (1.0 - (parts.A * R).sum(0))
    h = 0.5 * (columns * precision - W.square().sum(1))
    along_missed, along_noise = approximation.slopes(h, parts.missed)

    E = parts.L_inverse.T @ explained
    R.mul_(0.5 * columns * root).sub_(parts.V * along_missed)
    PG = (parts.L_inverse.T @ R).addmm_(E, W.T, alpha=-0.5)
    along_mm = -(PG @ parts.V.T) @ parts.L_inverse
    return value, _Slopes(2.0 * PG, along_mm, along_missed, along_noise)


def sparse_negative_log_likelihood(
    Z: Tensor,
    U: Tensor,
    log_kernel: Tensor,
    F: Tensor,
    columns: int,
    noise_floor: float = 0.0,
    approximation: ApproximationName = "vfe",
    weights: Tensor | None = None,
) -> Tensor:
    """Minus the approximate log-likelihood of observations with latent positions Z.

    Parameters
    ----------
    Z : Tensor, shape (n, q), float64
        Positions of the rows.
    U : Tensor, shape (m, q)
        Inducing positions.
    log_kernel : Tensor, shape (3,)
        (log θ1, log θ2, log of the noise variance above the floor).
    F : Tensor, shape (n, r)
        Any factor with F Fᵀ = X Xᵀ, see `facert.models.gp.likelihood.compact_factor`; constant.
    columns : int
        d, the number of columns of X.
    noise_floor : float
        Least noise variance, so that θ3⁻¹ = noise_floor + exp(log_kernel[2]).
    approximation : {"vfe", "fitc"}
        See the head of this file.
    weights : Tensor, shape (n,), optional
        A row of weight w counts as w rows that are alike; by default 1.

    Returns
    -------
    Tensor, scalar
        Differentiable once in Z, U and log_kernel. With U = Z it is the exact value, but for the
        jitter.

    Raises
    ------
    NumericalError
        When a matrix is not positive definite within the jitter ladder.
    """
    if weights is None:
        weights = Z.new_ones(len(Z))
    value: Tensor = _SparseNegativeLogLikelihood.apply(  # type: ignore[no-untyped-call]
        Z, U, log_kernel, F, weights, columns, noise_floor, APPROXIMATIONS[approximation]
    )
    return value
