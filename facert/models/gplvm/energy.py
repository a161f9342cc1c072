"""What training of the exact model minimises, Eq. (4), with its gradient, at once on the CPU.

The likelihoods of both views (1), (2) and the prior (5) know their gradients in closed form, so
that nothing is left for torch to differentiate: told as one function instead of a sum of three, an
evaluation takes a third less.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from facert.data.arrays import FloatArray, IntArray
from facert.models.gp.lapack import value_and_gradient
from facert.models.gplvm.prior import product


@dataclass(frozen=True, eq=False)
class View:
    """Observations of one side.

    Parameters
    ----------
    rows : slice or array of int, shape (n,)
        The latent coordinates that it sees.
    factor : array, shape (n, r)
        See `facert.models.gp.likelihood.compact_factor`.
    columns : int
        d.
    noise_floor : float
        Least noise variance.
    """

    rows: slice | IntArray
    factor: FloatArray
    columns: int
    noise_floor: float


class _Energy(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        Z: Tensor,
        log_kernel_x: Tensor,
        log_kernel_y: Tensor,
        L: Tensor,
        source: View,
        target: View,
    ) -> Tensor:
        """The value; the gradient is computed beside it, and kept for `backward`."""
        latents, dZ = Z.detach().numpy(), product(L, Z.detach()).numpy()
        value, slopes = 0.5 * float(np.vdot(latents, dZ)), []
        for view, log_kernel in ((source, log_kernel_x), (target, log_kernel_y)):
            term, own, slope = value_and_gradient(
                latents[view.rows],
                log_kernel.detach().numpy(),
                view.factor,
                view.columns,
                view.noise_floor,
            )
            value += term
            dZ[view.rows] += own
            slopes.append(torch.from_numpy(slope))
        ctx.gradients = (torch.from_numpy(dZ), *slopes)
        return torch.from_numpy(np.array(value))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, upstream: Tensor) -> tuple[Tensor | None, ...]:
        return *(upstream * gradient for gradient in ctx.gradients), None, None, None


def energy(
    Z: Tensor, log_kernel_x: Tensor, log_kernel_y: Tensor, L: Tensor, source: View, target: View
) -> Tensor:
    """-log P(X|Z) P(Y|Z) P(Z) but for the prior's constant, on the CPU.

    Parameters
    ----------
    Z : Tensor, shape (N, q)
        Latent coordinates.
    log_kernel_x, log_kernel_y : Tensor, shape (3,)
        See `facert.models.gp.likelihood.negative_log_likelihood`.
    L : Tensor, shape (N, N)
        Precision of the prior, see `facert.models.gplvm.prior`.
    source, target : View

    Returns
    -------
    Tensor, scalar
        Differentiable once in Z and both log-kernel parameters.

    Raises
    ------
    NumericalError
        When a kernel matrix is not positive definite within the jitter ladder.
    """
    value: Tensor = _Energy.apply(  # type: ignore[no-untyped-call]
        Z, log_kernel_x, log_kernel_y, L, source, target
    )
    return value
