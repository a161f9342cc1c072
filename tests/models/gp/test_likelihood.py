import numpy as np
import pytest
import torch
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from torch.distributions import MultivariateNormal

from facert.errors import NumericalError
from facert.models.closed_form import closed_form
from facert.models.gp import likelihood
from facert.models.gp.lapack import value_and_gradient
from facert.models.gp.likelihood import by_torch, compact_factor
from facert.models.kernels import KERNELS, SquaredExponential

COLUMNS = 6
FLOOR = 0.02

every_kernel = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)


def negative_log_likelihood(Z, log_kernel, F, columns, noise_floor=0.0, kernel=SquaredExponential):
    """As a function that torch can differentiate."""
    rest = F, columns, noise_floor, kernel
    return closed_form(
        lambda *variables: likelihood.negative_log_likelihood(*variables, *rest), Z, log_kernel
    )


@pytest.fixture
def problem():
    """Positions, log-kernel parameters and observations of rank 3."""
    generator = torch.Generator().manual_seed(0)

    def normal(*shape):
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    Z = normal(10, 2).requires_grad_()
    log_kernel = torch.tensor([1.3, 0.7, 0.05], dtype=torch.float64).log().requires_grad_()
    return Z, log_kernel, normal(10, 3) @ normal(3, COLUMNS)


def through_autograd(Z, log_kernel, X, floor):
    """The same by differentiation through torch's own Cholesky."""
    theta1, theta2, excess = log_kernel.exp()
    squared = (Z[:, None] - Z).square().sum(-1)
    K = theta1 * torch.exp(-0.5 * theta2 * squared) + (excess + floor) * torch.eye(len(Z)).to(Z)
    return -MultivariateNormal(torch.zeros(len(Z)).to(Z), K).log_prob(X.T).sum()


def test_the_value_is_that_of_scikit_learn_summed_over_columns(problem):
    Z, log_kernel, X = problem
    theta1, theta2, excess = log_kernel.detach().exp().tolist()
    kernel = ConstantKernel(theta1) * RBF(theta2**-0.5) + WhiteKernel(excess + FLOOR)
    model = GaussianProcessRegressor(kernel, alpha=0.0, optimizer=None)
    model.fit(Z.detach().numpy(), X.numpy())
    value = negative_log_likelihood(Z, log_kernel, X, COLUMNS, FLOOR)
    assert -value.item() == pytest.approx(model.log_marginal_likelihood(), rel=1e-12)


@every_kernel
def test_the_closed_form_gradient_passes_gradcheck(problem, kernel):
    Z, log_kernel, X = problem
    assert torch.autograd.gradcheck(
        lambda *variables: negative_log_likelihood(*variables, X, COLUMNS, FLOOR, kernel),
        (Z, log_kernel),
    )


def test_the_closed_form_gradient_is_that_of_autograd_through_the_cholesky(problem):
    Z, log_kernel, X = problem
    ours = negative_log_likelihood(Z, log_kernel, X, COLUMNS, FLOOR)
    theirs = through_autograd(Z, log_kernel, X, FLOOR)
    torch.testing.assert_close(ours, theirs, rtol=1e-12, atol=0.0)
    for a, b in zip(
        torch.autograd.grad(ours, (Z, log_kernel)),
        torch.autograd.grad(theirs, (Z, log_kernel)),
        strict=True,
    ):
        torch.testing.assert_close(a, b, rtol=1e-9, atol=1e-9)


@every_kernel
@pytest.mark.parametrize("points", [1, 2, 10, 60])
def test_lapack_and_torch_agree(points, kernel):
    rng = np.random.default_rng(points)
    Z, X = rng.normal(size=(points, 3)), rng.normal(size=(points, COLUMNS))
    given = Z, np.log([1.3, 0.7, 0.05]), X
    ours = value_and_gradient(*given, COLUMNS, FLOOR, kernel)
    theirs = by_torch(*(torch.from_numpy(array) for array in given), COLUMNS, FLOOR, kernel)
    assert ours[0] == pytest.approx(theirs[0].item(), rel=1e-12)
    for a, b in zip(ours[1:], theirs[1:], strict=True):
        # Where a single point lies tells nothing: its slopes are differences of terms of size 1.
        atol = 1e-12 * max(1.0, np.abs(a).max())
        np.testing.assert_allclose(a, b.numpy(), rtol=1e-12, atol=atol)


def test_lapack_leaves_what_it_is_given_as_it_was():
    rng = np.random.default_rng(0)
    given = rng.normal(size=(9, 2)), np.zeros(3), rng.normal(size=(9, COLUMNS))
    before = [array.copy() for array in given]
    value_and_gradient(*given, COLUMNS, FLOOR)
    for array, kept in zip(given, before, strict=True):
        np.testing.assert_array_equal(array, kept)


def test_two_rows_at_one_place_with_hardly_any_noise_climb_the_ladder(caplog):
    Z = np.repeat(np.random.default_rng(0).normal(size=(20, 2)), 2, axis=0)
    value, dZ, _ = value_and_gradient(Z, np.array([0.0, 0.0, -80.0]), Z, 2, 0.0)
    assert "to the diagonal" in caplog.text
    assert np.isfinite(value)
    assert np.isfinite(dZ).all()


def test_the_compact_factor_changes_neither_value_nor_gradient(problem):
    Z, log_kernel, X = problem
    F = compact_factor(X)
    assert F.shape == (10, 3)
    torch.testing.assert_close(F @ F.T, X @ X.T)
    full = negative_log_likelihood(Z, log_kernel, X, COLUMNS, FLOOR)
    compact = negative_log_likelihood(Z, log_kernel, F, COLUMNS, FLOOR)
    torch.testing.assert_close(compact, full, rtol=1e-12, atol=0.0)
    torch.testing.assert_close(*(torch.autograd.grad(v, Z)[0] for v in (compact, full)))


def test_directions_whose_square_is_lost_in_rounding_are_left_out():
    rng = np.random.default_rng(0)
    large, small = rng.normal(size=(30, 4)) @ rng.normal(size=(4, 9)), rng.normal(size=(30, 9))
    X = torch.from_numpy(large + 1e-9 * small)
    F = compact_factor(X)
    assert F.shape == (30, 4)
    torch.testing.assert_close(F @ F.T, X @ X.T, rtol=0.0, atol=1e-12)
    assert compact_factor(torch.from_numpy(large + 1e-5 * small)).shape == (30, 9)


def test_observations_that_are_all_zero_have_a_factor_without_columns(problem):
    Z, log_kernel, X = problem
    F = compact_factor(torch.zeros_like(X))
    assert F.shape == (10, 0)
    assert negative_log_likelihood(Z, log_kernel, F, COLUMNS).isfinite()


def test_the_floor_adds_to_the_noise(problem):
    Z, log_kernel, X = problem
    raised = log_kernel.detach().clone()
    raised[2] = (raised[2].exp() + FLOOR).log()
    torch.testing.assert_close(
        negative_log_likelihood(Z, log_kernel, X, COLUMNS, FLOOR),
        negative_log_likelihood(Z, raised, X, COLUMNS, 0.0),
    )


def test_the_floor_bounds_the_value_where_the_noise_goes_to_zero():
    """Two frames at one place that differ: without noise that is impossible."""
    Z = torch.zeros(2, 1, dtype=torch.float64)
    X = torch.tensor([[1.0], [-1.0]], dtype=torch.float64)
    no_noise = torch.tensor([0.0, 0.0, -1000.0], dtype=torch.float64)
    assert negative_log_likelihood(Z, no_noise, X, 1, FLOOR).item() < 100.0
    assert negative_log_likelihood(Z, no_noise, X, 1, 0.0).item() > 1e5


def test_parameters_that_overflow_raise(problem):
    Z, _, X = problem
    with pytest.raises(NumericalError):
        negative_log_likelihood(Z, torch.full((3,), 1000.0, dtype=torch.float64), X, COLUMNS)
