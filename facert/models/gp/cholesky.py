"""Cholesky factorisation of torch tensors, with the ladder of `facert.models.gp.jitter`."""

from __future__ import annotations

import torch
from torch import Tensor

from facert.errors import NumericalError
from facert.models.gp.jitter import climb


def cholesky(K: Tensor) -> Tensor:
    """Lower Cholesky factor of a symmetric positive definite matrix.

    Parameters
    ----------
    K : Tensor, shape (n, n)
        Only the lower triangle is read.

    Returns
    -------
    Tensor, shape (n, n)
        L with L Lᵀ = K + jitter I. A jitter other than 0 is logged as a warning.

    Raises
    ------
    NumericalError
        When the matrix holds NaN or infinity, or no rung of the ladder helps.
    """
    factor: Tensor
    factor, info = torch.linalg.cholesky_ex(K)
    # LAPACK takes infinity on the diagonal for positive.
    if not info.item() and torch.isfinite(factor.diagonal()).all():
        return factor
    # Jitter cannot mend NaN, so look for it before the ladder is tried.
    if not torch.isfinite(K).all():
        raise NumericalError("the kernel matrix holds NaN or infinity")

    def factorise(jitter: float) -> Tensor | None:
        L: Tensor
        L, info = torch.linalg.cholesky_ex(K + jitter * torch.eye(len(K)).to(K))
        return None if info.item() else L

    return climb(factorise, len(K), float(K.diagonal().mean()))
