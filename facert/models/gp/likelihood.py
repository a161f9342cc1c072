"""The exact Gaussian process likelihood and its closed-form gradient.

Eqs. (1) and (2) of Bouaziz and Pauly (2014): every column of X (n, d) is drawn from N(0, K_Z),

    -log P(X|Z) = d/2 log|K| + 1/2 tr(K⁻¹ X Xᵀ) + n d/2 log 2π.

The gradient comes from one Cholesky factor. With A = K⁻¹ F, where F Fᵀ = X Xᵀ, S the squared
distances and k' the kernel's slope,

    G = ∂(-log P)/∂K = (d K⁻¹ - A Aᵀ)/2,      W = G ∘ k(S),      V = G ∘ k'(S),
    ∂/∂Z      = 4 (diag(V 1) Z - V Z),
    ∂/∂log θ1 = Σ W,      ∂/∂log θ2 = Σ V ∘ S = <Z, ∂/∂Z>/2,      ∂/∂noise = tr G.

On the CPU `facert.models.gp.lapack` does the same in place.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from facert.models.gp.cholesky import cholesky
from facert.models.gp.lapack import value_and_gradient
from facert.models.kernels import Kernel, SquaredExponential


def compact_factor(X: Tensor) -> Tensor:
    """F (n, r) with F Fᵀ = X Xᵀ to rounding and r its rank: only this product is ever needed."""
    U, S, _ = torch.linalg.svd(X, full_matrices=False)
    squares = S.square()
    least = squares[:1] * max(X.shape) * torch.finfo(X.dtype).eps
    rank = int((squares > least).sum())
    F: Tensor = U[:, :rank] * S[:rank]
    return F.contiguous()


def negative_log_likelihood(
    Z: Tensor,
    log_kernel: Tensor,
    F: Tensor,
    columns: int,
    noise_floor: float = 0.0,
    kernel: type[Kernel] = SquaredExponential,
) -> tuple[Tensor, Tensor, Tensor]:
    """Minus the log-likelihood of observations with latent (or input) positions Z.

    Parameters
    ----------
    Z : Tensor, shape (n, q), float64
        Positions.
    log_kernel : Tensor, shape (3,)
        (log θ1, log θ2, log of the noise variance above the floor).
    F : Tensor, shape (n, r)
        Any factor with F Fᵀ = X Xᵀ, see `compact_factor`.
    columns : int
        d, the number of columns of X.
    noise_floor : float
        Least noise variance, so that θ3⁻¹ = noise_floor + exp(log_kernel[2]).
    kernel : subclass of Kernel

    Returns
    -------
    value : Tensor, scalar
        -log P(X|Z).
    dZ, d_log_kernel : Tensor
        Gradient of the value; see `facert.models.closed_form` for torch's use.

    Raises
    ------
    NumericalError
        When the kernel matrix is not positive definite within the jitter ladder.
    """
    if Z.device.type != "cpu":
        return by_torch(Z, log_kernel, F, columns, noise_floor, kernel)
    value, *gradient = value_and_gradient(
        Z.numpy(), log_kernel.numpy(), F.numpy(), columns, noise_floor, kernel
    )
    dZ, d_log_kernel = (torch.from_numpy(array) for array in gradient)
    # torch.tensor takes ten times as long.
    return torch.from_numpy(np.array(value)), dZ, d_log_kernel


def by_torch(
    Z: Tensor,
    log_kernel: Tensor,
    F: Tensor,
    columns: int,
    noise_floor: float,
    kernel: type[Kernel],
) -> tuple[Tensor, Tensor, Tensor]:
    """`negative_log_likelihood` in torch's operations, on any device."""
    k = kernel.from_log(log_kernel.cpu().numpy(), noise_floor)
    squared = squared_distances(Z, Z).fill_diagonal_(0.0)  # whatever rounding made of it
    K_smooth = k.value(squared)
    K = K_smooth.clone()
    K.diagonal().add_(k.noise)
    L = cholesky(K)
    K_inverse = torch.cholesky_inverse(L)
    A = K_inverse @ F
    log_determinant = 2.0 * L.diagonal().log().sum()
    data = torch.dot(F.reshape(-1), A.reshape(-1))
    # Eq. (1)
    value = 0.5 * (columns * log_determinant + data + len(Z) * columns * math.log(2.0 * math.pi))

    G = torch.addmm(K_inverse, A, A.T, beta=0.5 * columns, alpha=-0.5)
    W = K_smooth.mul_(G)
    V = W * k.relative_slope(squared)
    dZ = 4.0 * (V.sum(1)[:, None] * Z - V @ Z)
    d_noise = log_kernel[2].exp() * G.diagonal().sum()
    return value, dZ, torch.stack([W.sum(), 0.5 * (Z * dZ).sum(), d_noise])


def squared_distances(Z: Tensor, U: Tensor) -> Tensor:
    """|z_i - u_j|² of positions (n, q) and (m, q), (n, m), to rounding."""
    squares = Z.square().sum(1)[:, None] + U.square().sum(1)
    return torch.addmm(squares, Z, U.T, alpha=-2.0)
