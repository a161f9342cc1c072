"""Cholesky factorisation with a jitter ladder that reports itself."""

from __future__ import annotations

import logging

import torch
from torch import Tensor

from facert.errors import NumericalError

log = logging.getLogger(__name__)

# Relative to the mean of the diagonal. The first rung is the matrix as it is.
JITTER_LADDER = (0.0, 1e-12, 1e-10, 1e-8, 1e-6)


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
    scale = float(K.diagonal().mean())
    for rung in JITTER_LADDER[1:]:
        jitter = rung * scale
        factor, info = torch.linalg.cholesky_ex(K + jitter * torch.eye(len(K)).to(K))
        if not info.item():
            log.warning("added %.1e to the diagonal of a %d x %d kernel", jitter, *K.shape)
            return factor
    raise NumericalError(
        f"a {len(K)} x {len(K)} kernel matrix is not positive definite, even with "
        f"{jitter:.1e} on its diagonal: raise the noise floor"
    )
