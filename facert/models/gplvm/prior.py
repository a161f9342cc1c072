"""The precision of the prior over latent coordinates, Eq. (5), dense or sparse by its size."""

from __future__ import annotations

import math

import numpy as np
import torch
from scipy import sparse
from scipy.sparse.linalg import splu
from torch import Tensor

# Up to so many latent coordinates a dense product is quicker than a sparse one.
DENSE = 500


def latent_precision(
    M: sparse.csr_array | None, points: int, latent_dim: int
) -> tuple[Tensor, float]:
    """L = MᵀM + I and the constant of -log P(Z) = tr(Zᵀ L Z)/2 + constant, Eq. (5).

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
    """L Z, (N, q): the gradient of tr(Zᵀ L Z)/2."""
    if L.is_sparse or L.device.type != "cpu":
        return L @ Z
    return torch.from_numpy(L.numpy() @ Z.numpy())  # NumPy takes half the time


def _log_determinant(L: sparse.csc_array) -> float:
    """log|L| of a symmetric positive definite matrix."""
    factors = splu(
        L,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return float(np.log(np.abs(factors.U.diagonal())).sum())
