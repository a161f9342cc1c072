"""The bridge between a module's named tensors and the flat vector that optimisers work on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast

import numpy as np
import torch
from torch import Tensor, nn

from facert.data.arrays import FloatArray
from facert.errors import NumericalError
from facert.models.optim.arrow import Arrow


class ClosedForm(Protocol):
    """A module that knows its gradient."""

    def value_and_gradient(self) -> Sequence[Tensor]:
        """Its value, and the gradient in each of its parameters."""
        ...


class FlatObjective:
    """A module's scalar output as a function of one flat vector.

    Parameters
    ----------
    module : Module
        Called without arguments; its parameters are the variables, in the order of
        ``named_parameters``. One that knows its gradient has ``value_and_gradient()`` as well,
        which returns both without a graph, in a tenth less time.
    """

    def __init__(self, module: nn.Module) -> None:
        self.module = module
        self.parameters = list(module.parameters())
        self.evaluations = 0

    @property
    def vector(self) -> FloatArray:
        """The present parameters, (n,)."""
        return np.concatenate([p.detach().cpu().numpy().ravel() for p in self.parameters])

    @vector.setter
    def vector(self, x: FloatArray) -> None:
        start = 0
        with torch.no_grad():
            for parameter in self.parameters:
                part = x[start : start + parameter.numel()]
                parameter.copy_(torch.from_numpy(part).reshape(parameter.shape))
                start += parameter.numel()

    def __call__(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Value and gradient at x; an infinite value where the model cannot be evaluated."""
        self.vector = x
        self.evaluations += 1
        try:
            value, *gradients = self._value_and_gradient()
        except NumericalError:
            return np.inf, np.zeros_like(x)
        flat = np.concatenate([g.cpu().numpy().ravel() for g in gradients])
        if not (np.isfinite(value.item()) and np.isfinite(flat).all()):
            return np.inf, np.zeros_like(x)
        return float(value.item()), flat

    def curvature(self, x: FloatArray) -> Arrow | None:
        """The Hessian at x; None of a module that does not know it, or where it is not there."""
        self.vector = x
        curvature = getattr(self.module, "curvature", None)
        if curvature is None:
            return None
        try:
            return cast("Arrow | None", curvature())
        except NumericalError:
            return None

    def _value_and_gradient(self) -> Sequence[Tensor]:
        if hasattr(self.module, "value_and_gradient"):
            return cast(ClosedForm, self.module).value_and_gradient()
        value = self.module()
        return value, *torch.autograd.grad(value, self.parameters)
