"""The Gaussian process likelihood through a few inducing positions, at a cost linear in the rows.

m positions U stand for the n rows: with Q = K_nm K_mm⁻¹ K_mn, K_mm the kernel among them and K_mn
that between them and the rows, every column of X is drawn from N(0, Q + Λ), Λ diagonal.

* `VFE`, the collapsed variational bound (Titsias 2009): Λ = s I, s the noise, and d/(2 s) tr(K - Q)
  is added. The result is never below the exact value, and more positions never make it worse.
* `FITC` (Snelson and Ghahramani 2006): Λ = diag(K - Q) + s I, so that the variance of each row is
  right. The diagonal then does the work of the noise, which the likelihood takes to zero where it
  can (see `facert.models.kernels` for the consequence): FITC is for use with a noise floor, as the
  shared models always have one.

A row may have a weight w and then counts as w rows that are alike; Λ is divided by it. With the
factors L Lᵀ = K_mm, V = L⁻¹ K_mn, A = V Λ^-½ and B = I + A Aᵀ an evaluation costs O(n m²). For
F Fᵀ = X Xᵀ, f = -log P and G = ∂f/∂Q the gradient follows from

    ∂f/∂K_mn = 2 P G,      ∂f/∂K_mm = -P G Pᵀ,      P = K_mm⁻¹ K_mn = L⁻ᵀ V,
    P G = L⁻ᵀ (d/2 B⁻¹ A Λ^-½ - V diag(g)) - E Wᵀ/2,
    W = (Q + Λ)⁻¹ F = Λ^-½ (I - Aᵀ B⁻¹ A) Λ^-½ F,      E = P W = L⁻ᵀ B⁻¹ A Λ^-½ F,

where g is the slope of f along the diagonal of K - Q: d w/(2 s) for VFE, and for FITC that which
follows from h = (d diag (Q + Λ)⁻¹ - |W_i|²)/2, the slope along Λ. No matrix has n² entries.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, Protocol

import torch
from torch import Tensor

from facert.models.gp.cholesky import cholesky
from facert.models.gp.likelihood import squared_distances
from facert.models.kernels import Kernel, SquaredExponential

ApproximationName = Literal["vfe", "fitc"]
# Variance of the inducing values themselves beside θ1, relative to it, without which K_mm would be
# singular. A bound remains a bound, as if the values were seen through so much noise.
JITTER = 1e-10


@dataclass(frozen=True)
class Residual:
    """The variance that the inducing positions leave of the rows, with their weights."""

    variance: Tensor  # (n,): The diagonal of K - Q
    weights: Tensor  # (n,): w
    noise: float  # s
    columns: int  # d

    def repeats(self, variance: Tensor) -> Tensor:
        """-log N of w equal rows with these variances (n,), less that of one row at 1/w of it."""
        logs = (self.weights - 1.0) * (2.0 * math.pi * variance).log() + self.weights.log()
        return 0.5 * self.columns * logs.sum()


class Approximation(Protocol):
    """A treatment of the residual."""

    def diagonal(self, residual: Residual) -> Tensor:
        """The diagonal Λ, (n,)."""
        ...

    def penalty(self, residual: Residual) -> Tensor:
        """The objective less -log N(0, Q + Λ), a scalar."""
        ...

    def slopes(self, h: Tensor, residual: Residual) -> tuple[Tensor, Tensor]:
        """Slopes of the objective along the diagonal of K - Q, (n,), and along the noise.

        `h` (n,) is the slope of -log N(0, Q + Λ) along Λ.
        """
        ...


class VFE:
    """The collapsed variational bound."""

    def diagonal(self, residual: Residual) -> Tensor:
        """Λ is the noise alone."""
        return residual.noise / residual.weights

    def penalty(self, residual: Residual) -> Tensor:
        """The bound's trace term."""
        trace = (residual.weights * residual.variance).sum()
        repeats = residual.repeats(torch.full_like(residual.variance, residual.noise))
        return 0.5 * residual.columns / residual.noise * trace + repeats

    def slopes(self, h: Tensor, residual: Residual) -> tuple[Tensor, Tensor]:
        """Along K - Q the trace term's; the noise is in Λ, in the trace term and in the repeats."""
        w, s = residual.weights, residual.noise
        along = 0.5 * residual.columns / s * w
        rest = 0.5 * residual.columns / s * (w - 1.0) - along * residual.variance / s
        return along, (h / w + rest).sum()


class FITC:
    """The fully independent training conditional."""

    def diagonal(self, residual: Residual) -> Tensor:
        """Λ is the noise and the residual."""
        return (residual.variance + residual.noise) / residual.weights

    def penalty(self, residual: Residual) -> Tensor:
        """FITC has a penalty for repeated rows only."""
        return residual.repeats(residual.variance + residual.noise)

    def slopes(self, h: Tensor, residual: Residual) -> tuple[Tensor, Tensor]:
        """The noise adds to the residual: their slopes are alike."""
        w, v = residual.weights, residual.variance + residual.noise
        along = h / w + 0.5 * residual.columns * (w - 1.0) / v
        return along, along.sum()


APPROXIMATIONS: Mapping[ApproximationName, Approximation] = MappingProxyType(
    {"vfe": VFE(), "fitc": FITC()}
)


@dataclass(frozen=True)
class SparseFactors:
    """L⁻¹, V, A, B and Λ of the head of this file."""

    L_inverse: Tensor  # (m, m)
    # (m, n)
    V: Tensor
    A: Tensor
    B_cholesky: Tensor  # (m, m): Lower factor of B
    diagonal: Tensor  # (n,): Λ
    residual: Residual


def factorise(
    K_mm: Tensor,
    K_mn: Tensor,
    weights: Tensor,
    variance: float,
    noise: float,
    columns: int,
    approximation: Approximation,
) -> SparseFactors:
    """The factors that value, gradient and posterior are made from.

    Parameters
    ----------
    K_mm, K_mn : Tensor, shapes (m, m) and (m, n)
        Kernel matrices without noise and jitter.
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
    left = (variance - V.square().sum(0)).clamp_(min=0.0)  # diag(K - Q)
    residual = Residual(left, weights, noise, columns)
    diagonal = approximation.diagonal(residual)  # Λ
    A = V * diagonal.rsqrt()  # V Λ^-½, and below B = I + A Aᵀ
    return SparseFactors(
        L_inverse, V, A, cholesky(torch.addmm(identity, A, A.T)), diagonal, residual
    )


def sparse_negative_log_likelihood(
    Z: Tensor,
    U: Tensor,
    log_kernel: Tensor,
    F: Tensor,
    columns: int,
    noise_floor: float = 0.0,
    kernel: type[Kernel] = SquaredExponential,
    approximation: ApproximationName = "vfe",
    weights: Tensor | None = None,
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Minus the approximate log-likelihood of observations with latent positions Z.

    Parameters
    ----------
    Z : Tensor, shape (n, q), float64
        Positions of the rows.
    U : Tensor, shape (m, q)
        Inducing positions.
    log_kernel, F, columns, noise_floor, kernel
        As of `facert.models.gp.likelihood.negative_log_likelihood`.
    approximation : {"vfe", "fitc"}
        See the head of this file.
    weights : Tensor, shape (n,), optional
        A row of weight w counts as w rows that are alike; by default 1.

    Returns
    -------
    value : Tensor, scalar
        With U = Z it is the exact value, but for the jitter.
    dZ, dU, d_log_kernel : Tensor
        Gradient of the value.

    Raises
    ------
    NumericalError
        When a matrix is not positive definite within the jitter ladder.
    """
    k, rule = kernel.from_log(log_kernel.cpu().numpy(), noise_floor), APPROXIMATIONS[approximation]
    S_mm, S_mn = squared_distances(U, U), squared_distances(U, Z)
    K_mm, K_mn = k.value(S_mm), k.value(S_mn)
    weights = Z.new_ones(len(Z)) if weights is None else weights
    parts = factorise(K_mm, K_mn, weights, k.variance, k.noise, columns, rule)
    value, slopes = _value_and_slopes(parts, F, rule)

    T_mn, T_mm = K_mn.mul_(slopes.K_mn), K_mm.mul_(slopes.K_mm)
    diagonals = k.variance * (slopes.residual.sum() + JITTER * slopes.K_mm.trace())
    d_variance = T_mn.sum() + T_mm.sum() + diagonals
    V_mn, V_mm = T_mn.mul_(k.relative_slope(S_mn)), T_mm.mul_(k.relative_slope(S_mm))
    dZ = 2.0 * (V_mn.sum(0)[:, None] * Z - V_mn.T @ U)
    dU = 2.0 * (V_mn.sum(1)[:, None] * U - V_mn @ Z)
    dU += 4.0 * (V_mm.sum(1)[:, None] * U - V_mm @ U)
    d_inverse_width = 0.5 * ((Z * dZ).sum() + (U * dU).sum())
    d_noise = log_kernel[2].exp() * slopes.noise
    return value, dZ, dU, torch.stack([d_variance, d_inverse_width, d_noise])


@dataclass(frozen=True)
class _Slopes:
    """Slopes of the value along K_mn (m, n), K_mm (m, m), diag(K - Q) (n,) and the noise."""

    K_mn: Tensor
    K_mm: Tensor
    residual: Tensor
    noise: Tensor


def _value_and_slopes(
    parts: SparseFactors, F: Tensor, approximation: Approximation
) -> tuple[Tensor, _Slopes]:
    root, columns = parts.diagonal.rsqrt(), parts.residual.columns
    scaled = F * root[:, None]
    AF = parts.A @ scaled
    explained = torch.cholesky_solve(AF, parts.B_cholesky)  # B⁻¹ A Λ^-½ F
    log_determinant = (2.0 * math.pi * parts.diagonal).log().sum()
    log_determinant += 2.0 * parts.B_cholesky.diagonal().log().sum()
    data = scaled.square().sum() - (AF * explained).sum()
    penalty = approximation.penalty(parts.residual)
    value = 0.5 * (columns * log_determinant + data) + penalty

    R = torch.cholesky_inverse(parts.B_cholesky) @ parts.A  # B⁻¹ A
    W = torch.addmm(scaled, parts.A.T, explained, alpha=-1.0).mul_(root[:, None])
    precision = root.square() * (1.0 - (parts.A * R).sum(0))
    h = 0.5 * (columns * precision - W.square().sum(1))
    along_residual, along_noise = approximation.slopes(h, parts.residual)

    E = parts.L_inverse.T @ explained
    R.mul_(0.5 * columns * root).sub_(parts.V * along_residual)
    PG = (parts.L_inverse.T @ R).addmm_(E, W.T, alpha=-0.5)
    along_mm = -(PG @ parts.V.T) @ parts.L_inverse
    return value, _Slopes(2.0 * PG, along_mm, along_residual, along_noise)
