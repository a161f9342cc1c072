"""The exact Gaussian process likelihood and its closed-form gradient.

Eqs. (1) and (2) of Bouaziz and Pauly (2014): every column of X (n, d) is drawn from N(0, K_Z),

    -log P(X|Z) = d/2 log|K| + 1/2 tr(K⁻¹ X Xᵀ) + n d/2 log 2π.

The gradient comes from one Cholesky factor. With A = K⁻¹ F, where F Fᵀ = X Xᵀ,

    G = ∂(-log P)/∂K = (d K⁻¹ - A Aᵀ)/2,      W = G ∘ K_smooth,
    ∂/∂Z      = -2 θ2 (diag(W 1) Z - W Z),
    ∂/∂log θ1 = Σ W,      ∂/∂log θ2 = <Z, ∂/∂Z>/2,      ∂/∂noise = tr G,

K_smooth being K without its noise. Differentiating through the factorisation instead costs several
times as much and gives the same numbers; a test holds the two against each other. On the CPU
`facert.models.gp.lapack` does the same in place.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from facert.models.gp.cholesky import cholesky
from facert.models.gp.lapack import value_and_gradient


def compact_factor(X: Tensor) -> Tensor:
    """F (n, r) with F Fᵀ = X Xᵀ to rounding and r its rank: only this product is ever needed."""
    U, S, _ = torch.linalg.svd(X, full_matrices=False)
    squares = S.square()
    least = squares[:1] * max(X.shape) * torch.finfo(X.dtype).eps
    rank = int((squares > least).sum())
    F: Tensor = U[:, :rank] * S[:rank]
    return F.contiguous()


class _NegativeLogLikelihood(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, Z: Tensor, log_kernel: Tensor, F: Tensor, columns: int, noise_floor: float
    ) -> Tensor:
        """The value; the gradient is computed beside it, and kept for `backward`."""
        evaluate = _by_lapack if Z.device.type == "cpu" else by_torch
        value, dZ, d_log_kernel = evaluate(Z, log_kernel, F, columns, noise_floor)
        ctx.save_for_backward(dZ, d_log_kernel)
        return value

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, upstream: Tensor) -> tuple[Tensor | None, ...]:
        dZ, d_log_kernel = ctx.saved_tensors
        return upstream * dZ, upstream * d_log_kernel, None, None, None


def _by_lapack(
    Z: Tensor, log_kernel: Tensor, F: Tensor, columns: int, noise_floor: float
) -> tuple[Tensor, Tensor, Tensor]:
    value, dZ, d_log_kernel = value_and_gradient(
        Z.detach().numpy(), log_kernel.detach().numpy(), F.numpy(), columns, noise_floor
    )
    return (
        torch.from_numpy(np.array(value)),  # torch.tensor takes ten times as long
        torch.from_numpy(dZ),
        torch.from_numpy(d_log_kernel),
    )


def by_torch(
    Z: Tensor, log_kernel: Tensor, F: Tensor, columns: int, noise_floor: float
) -> tuple[Tensor, Tensor, Tensor]:
    """The value and its derivatives with respect to Z and log_kernel, on any device.

    Parameters are those of `negative_log_likelihood`; nothing is recorded for differentiation.
    """
    theta1, theta2, excess = log_kernel.exp().tolist()
    n = len(Z)

    squared = Z.square().sum(1)
    K_smooth = torch.addmm(squared[:, None] + squared, Z, Z.T, alpha=-2.0)
    # The diagonal is exactly zero; rounding must not make it anything else.
    K_smooth.clamp_(min=0.0).fill_diagonal_(0.0)
    K_smooth.mul_(-0.5 * theta2).exp_().mul_(theta1)

    K = K_smooth.clone()
    K.diagonal().add_(excess + noise_floor)
    L = cholesky(K)
    K_inverse = torch.cholesky_inverse(L)
    A = K_inverse @ F

    log_determinant = 2.0 * L.diagonal().log().sum()
    value = 0.5 * (
        columns * log_determinant
        + torch.dot(F.reshape(-1), A.reshape(-1))
        + n * columns * math.log(2.0 * math.pi)
    )

    G = torch.addmm(K_inverse, A, A.T, beta=0.5 * columns, alpha=-0.5)
    W = K_smooth.mul_(G)
    row_sums = W.sum(1)
    dZ = (-2.0 * theta2) * (row_sums[:, None] * Z - W @ Z)
    d_log_kernel = torch.stack([row_sums.sum(), 0.5 * (Z * dZ).sum(), excess * G.diagonal().sum()])
    return value, dZ, d_log_kernel


def negative_log_likelihood(
    Z: Tensor, log_kernel: Tensor, F: Tensor, columns: int, noise_floor: float = 0.0
) -> Tensor:
    """Minus the log-likelihood of observations with latent (or input) positions Z.

    Parameters
    ----------
    Z : Tensor, shape (n, q), float64
        Positions.
    log_kernel : Tensor, shape (3,)
        (log θ1, log θ2, log of the noise variance above the floor).
    F : Tensor, shape (n, r)
        Any factor with F Fᵀ = X Xᵀ, see `compact_factor`; constant.
    columns : int
        d, the number of columns of X.
    noise_floor : float
        Least noise variance, so that θ3⁻¹ = noise_floor + exp(log_kernel[2]).

    Returns
    -------
    Tensor, scalar
        -log P(X|Z), differentiable once in Z and log_kernel.

    Raises
    ------
    NumericalError
        When the kernel matrix is not positive definite within the jitter ladder.
    """
    value: Tensor = _NegativeLogLikelihood.apply(  # type: ignore[no-untyped-call]
        Z, log_kernel, F, columns, noise_floor
    )
    return value
