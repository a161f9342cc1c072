"""Scalars whose gradient is known in closed form, for torch to use as its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable


class _ClosedForm(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, evaluate: Callable[..., Sequence[Tensor]], *variables: Tensor) -> Tensor:
        """The value; the gradient is computed beside it, and kept for `backward`."""
        value, *ctx.gradients = evaluate(*(variable.detach() for variable in variables))
        return value

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, upstream: Tensor) -> tuple[Tensor | None, ...]:
        return None, *(upstream * gradient for gradient in ctx.gradients)


def closed_form(evaluate: Callable[..., Sequence[Tensor]], *variables: Tensor) -> Tensor:
    """A scalar that is differentiable once in its variables.

    Differentiating through a Cholesky factorisation costs several times what the closed form does.

    Parameters
    ----------
    evaluate : callable
        Takes the variables; returns the value and its gradient in each of them.
    *variables : Tensor
    """
    value: Tensor = _ClosedForm.apply(evaluate, *variables)  # type: ignore[no-untyped-call]
    return value
