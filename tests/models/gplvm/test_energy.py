"""The energy in one go is the sum of its terms, and so is its gradient."""

import numpy as np
import pytest
import torch

from facert.errors import NumericalError
from facert.models.closed_form import closed_form
from facert.models.gplvm import prior
from facert.models.gplvm.lle import constraint_matrix, view_rows
from facert.models.gplvm.module import GaussianView, SharedGPLVM
from facert.models.gplvm.sparse_view import SparseView, inducing_rows, row_weights
from facert.models.kernels import KERNELS, SquaredExponential
from facert.models.optim.flat import FlatObjective

LATENT = 3


def make_module(
    labelled=5, source=7, target=4, constrained=True, inducing=None, kernel=SquaredExponential
):
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(labelled + source, 6)), rng.normal(size=(labelled + target, 5))
    M = constraint_matrix(X, Y, labelled, 3) if constrained else None
    Z = rng.normal(size=(labelled + source + target, LATENT))

    def view(observations, rows, noise_floor):
        if inducing is None:
            return GaussianView(observations, rows, noise_floor, kernel)
        first = Z[rows[inducing_rows(len(rows), labelled, inducing)]]
        weights = row_weights(len(rows), labelled)
        return SparseView(observations, rows, noise_floor, kernel, first, weights)

    rows = view_rows(labelled, source, target)
    return SharedGPLVM(*map(view, (X, Y), rows, (0.01, 0.05)), M, Z)


def sum_of_energies(module):
    """Eq. (4) term by term, the prior differentiated by torch."""
    value = 0.5 * (module.Z * (module.precision @ module.Z)).sum() + module._prior_constant
    for view in (module.source, module.target):
        value += closed_form(
            lambda Z, *_, view=view: view.value_and_gradient(Z),
            module.Z[view.rows],
            *view.parameters(),
        )
    return value


def with_gradients(module, value):
    return value, *torch.autograd.grad(value, list(module.parameters()))


@pytest.mark.parametrize(
    "kind",
    [
        {},
        {"source": 0},
        {"target": 0},
        {"source": 0, "target": 0},
        {"constrained": False},
        {"inducing": 4},
    ],
)
def test_value_and_gradient_are_those_of_the_sum(kind):
    module = make_module(**kind)
    at_once = with_gradients(module, module())
    summed = with_gradients(module, sum_of_energies(module))
    for ours, theirs in zip(at_once, summed, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("inducing", [None, 4])
def test_the_optimisers_are_given_what_torch_is(inducing):
    module = make_module(inducing=inducing)
    value, *gradient = with_gradients(module, module())
    objective = FlatObjective(module)
    ours = objective(objective.vector)
    np.testing.assert_allclose(ours[0], value.item(), rtol=1e-12)
    expected = np.concatenate([part.numpy().ravel() for part in gradient])
    np.testing.assert_allclose(ours[1], expected, rtol=1e-12)


def test_a_sparse_prior_makes_no_difference(monkeypatch):
    dense = make_module()
    monkeypatch.setattr(prior, "DENSE", 0)
    sparse = make_module()
    assert sparse.precision.is_sparse
    pairs = zip(with_gradients(dense, dense()), with_gradients(sparse, sparse()), strict=True)
    for ours, theirs in pairs:
        torch.testing.assert_close(ours, theirs, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("inducing", [None, 2])
@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
def test_the_gradient_passes_gradcheck(kernel, inducing):
    module = make_module(2, 2, 1, inducing=inducing, kernel=kernel)
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
        module.target.log_kernel.fill_(1000.0)
    with pytest.raises(NumericalError):
        module()
