"""Cholesky factorisation of torch tensors, with the ladder of `facert.models.gp.jitter`."""

from __future__ import annotations

import torch
from torch import Tensor

from facert.models.gp.jitter import climb


def cholesky(K: Tensor) -> Tensor:
    """Lower Cholesky factor L, (n, n), of a symmetric positive definite matrix.

    L Lᵀ = K + jitter I; a jitter other than 0 is logged as a warning, see `climb` for errors.
    """

    def factorise(jitter: float) -> Tensor | None:
        L: Tensor
        L, info = torch.linalg.cholesky_ex(K + jitter * torch.eye(len(K)).to(K) if jitter else K)
        # LAPACK takes infinity on the diagonal for positive.
        return L if not info.item() and torch.isfinite(L.diagonal()).all() else None

    return climb(K, factorise)
