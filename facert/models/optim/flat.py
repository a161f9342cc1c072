"""The bridge between a module's named tensors and the flat vector that optimisers work on."""

from __future__ import annotations

import numpy as np
import torch
from torch import nn

from facert.data.arrays import FloatArray
from facert.errors import NumericalError


class FlatObjective:
    """A module's scalar output as a function of one flat vector.

    Parameters
    ----------
    module : Module
        Called without arguments; its parameters are the variables, in the order of
        ``named_parameters``.
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
            value = self.module()
        except NumericalError:
            return np.inf, np.zeros_like(x)
        gradients = torch.autograd.grad(value, self.parameters)
        flat = np.concatenate([g.cpu().numpy().ravel() for g in gradients])
        if not (np.isfinite(value.item()) and np.isfinite(flat).all()):
            return np.inf, np.zeros_like(x)
        return float(value.item()), flat
