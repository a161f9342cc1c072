"""The precision of the prior over latent coordinates, Eq. (5), dense or sparse by its size."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from scipy import sparse
from scipy.sparse.linalg import splu
from torch import Tensor
from torch.autograd.function import once_differentiable

# Up to so many latent coordinates a dense product is quicker than a sparse one.
DENSE = 500


def latent_precision(
    M: sparse.csr_array | None, points: int, latent_dim: int
) -> tuple[Tensor, float]:
    """L = MᵀM + I, and what -log P(Z) = tr(Zᵀ L Z)/2 + constant has beside its product.

    Parameters
    ----------
    M : csr_array, shape (constraints, points), or None
        Reconstruction constraints, Eq. (6); None leaves L = I.
    points, latent_dim : int
        N and q, the shape of Z.

    Returns
    -------
    L : Tensor, shape (N, N)
        Sparse (coordinate format) above `DENSE` points.
    constant : float
    """
    identity = sparse.eye_array(points, format="csc")
    L = identity if M is None else (M.T @ M + identity).tocsc()
    constant = 0.5 * latent_dim * (points * math.log(2.0 * math.pi) - _log_determinant(L))
    if points <= DENSE:
        return torch.from_numpy(L.toarray()), constant
    entries = L.tocoo()
    where = torch.from_numpy(np.stack([entries.row, entries.col]).astype(np.int64))
    values = torch.from_numpy(entries.data)
    shape = (points, points)
    return torch.sparse_coo_tensor(where, values, shape, check_invariants=True).coalesce(), constant


def product(L: Tensor, Z: Tensor) -> Tensor:
    """L Z, (N, q), not recorded for differentiation."""
    if L.is_sparse or L.device.type != "cpu":
        return L @ Z
    return torch.from_numpy(L.numpy() @ Z.numpy())  # NumPy takes half the time


class _HalfSquare(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, Z: Tensor, L: Tensor) -> Tensor:
        slope = product(L, Z.detach())
        ctx.save_for_backward(slope)
        return 0.5 * torch.dot(slope.reshape(-1), Z.reshape(-1))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, upstream: Tensor) -> tuple[Tensor, None]:
        (slope,) = ctx.saved_tensors
        return upstream * slope, None


def half_square(Z: Tensor, L: Tensor) -> Tensor:
    """tr(Zᵀ L Z)/2 for a symmetric L: its gradient L Z is at hand, and costs nothing more."""
    value: Tensor = _HalfSquare.apply(Z, L)  # type: ignore[no-untyped-call]
    return value


def _log_determinant(L: sparse.csc_array) -> float:
    """log|L| of a symmetric positive definite matrix."""
    factors = splu(
        L,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return float(np.log(np.abs(factors.U.diagonal())).sum())
