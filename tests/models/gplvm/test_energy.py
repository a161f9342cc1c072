"""The energy in one go is the sum of its terms, and so is its gradient."""

import numpy as np
import pytest
import torch

from facert.errors import NumericalError
from facert.models.gplvm import prior
from facert.models.gplvm.lle import constraint_matrix
from facert.models.gplvm.module import SharedGPLVM

LATENT = 3


def make_module(labelled=5, source=7, target=4, constrained=True):
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(labelled + source, 6)), rng.normal(size=(labelled + target, 5))
    M = constraint_matrix(X, Y, labelled, 3) if constrained else None
    Z = rng.normal(size=(labelled + source + target, LATENT))
    return SharedGPLVM(X, Y, labelled, M, Z, 0.01, 0.05)


def with_gradients(module, value):
    return value, *torch.autograd.grad(value, list(module.parameters()))


@pytest.mark.parametrize(
    "kind", [{}, {"source": 0}, {"target": 0}, {"source": 0, "target": 0}, {"constrained": False}]
)
def test_value_and_gradient_are_those_of_the_sum(kind):
    module = make_module(**kind)
    at_once = with_gradients(module, module())
    summed = with_gradients(module, module.sum_of_energies())
    for ours, theirs in zip(at_once, summed, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-10, atol=1e-10)


def test_a_sparse_prior_makes_no_difference(monkeypatch):
    dense = make_module()
    monkeypatch.setattr(prior, "DENSE", 0)
    sparse = make_module()
    assert sparse.precision.is_sparse
    pairs = zip(with_gradients(dense, dense()), with_gradients(sparse, sparse()), strict=True)
    for ours, theirs in pairs:
        torch.testing.assert_close(ours, theirs, rtol=1e-12, atol=1e-12)


def test_the_gradient_passes_gradcheck():
    module = make_module(2, 2, 1)
    variables = [p.detach().clone().requires_grad_() for p in module.parameters()]

    def energy(*values):
        names = [name for name, _ in module.named_parameters()]
        return torch.func.functional_call(module, dict(zip(names, values, strict=True)), ())

    assert torch.autograd.gradcheck(energy, variables)


def test_an_evaluation_leaves_the_parameters_as_they_were():
    module = make_module()
    before = [p.detach().clone() for p in module.parameters()]
    module().backward()
    for parameter, kept in zip(module.parameters(), before, strict=True):
        assert torch.equal(parameter, kept)


def test_parameters_that_overflow_raise():
    module = make_module()
    with torch.no_grad():
        module.log_kernel_y.fill_(1000.0)
    with pytest.raises(NumericalError):
        module()
