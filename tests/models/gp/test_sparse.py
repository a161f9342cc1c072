import pytest
import torch

from facert.errors import NumericalError
from facert.models.closed_form import closed_form
from facert.models.gp import likelihood, sparse
from facert.models.gp.likelihood import compact_factor
from facert.models.gp.sparse import APPROXIMATIONS
from facert.models.kernels import KERNELS, SquaredExponential

COLUMNS = 5
FLOOR = 0.02

every_approximation = pytest.mark.parametrize("approximation", APPROXIMATIONS)
every_kernel = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)


def negative_log_likelihood(Z, log_kernel, X, columns, floor, kernel=SquaredExponential):
    """As a function that torch can differentiate."""
    return closed_form(
        lambda *v: likelihood.negative_log_likelihood(*v, X, columns, floor, kernel), Z, log_kernel
    )


def sparse_negative_log_likelihood(
    Z,
    U,
    log_kernel,
    F,
    columns,
    floor=0.0,
    approximation="vfe",
    weights=None,
    kernel=SquaredExponential,
):
    """The same through inducing positions U."""
    rest = F, columns, floor, kernel, approximation, weights
    return closed_form(
        lambda *v: sparse.sparse_negative_log_likelihood(*v, *rest), Z, U, log_kernel
    )


def normal(*shape, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(*shape, generator=generator, dtype=torch.float64)


@pytest.fixture
def Z():
    return normal(24, 2).requires_grad_()


@pytest.fixture
def U():
    return normal(6, 2, seed=1).requires_grad_()


@pytest.fixture
def log_kernel():
    return torch.tensor([1.3, 0.7, 0.05], dtype=torch.float64).log().requires_grad_()


@pytest.fixture
def X():
    return normal(24, COLUMNS, seed=2)


@pytest.fixture
def weights():
    return torch.tensor([2.0] * 6 + [1.0] * 12 + [0.3] * 6, dtype=torch.float64)


@every_kernel
@every_approximation
def test_where_every_row_is_inducing_value_and_gradient_are_exact(
    approximation, Z, log_kernel, X, kernel
):
    """The latents' gradient is then shared between rows and inducing positions."""
    U = Z.detach().clone().requires_grad_()
    sparse = sparse_negative_log_likelihood(
        Z, U, log_kernel, X, COLUMNS, FLOOR, approximation, kernel=kernel
    )
    exact = negative_log_likelihood(Z, log_kernel, X, COLUMNS, FLOOR, kernel)
    torch.testing.assert_close(sparse, exact, rtol=1e-8, atol=0.0)
    d_Z, d_U, d_kernel = torch.autograd.grad(sparse, (Z, U, log_kernel))
    exact_Z, exact_kernel = torch.autograd.grad(exact, (Z, log_kernel))
    torch.testing.assert_close(d_Z + d_U, exact_Z, rtol=1e-6, atol=1e-6)
    torch.testing.assert_close(d_kernel, exact_kernel, rtol=1e-6, atol=1e-5)


@every_kernel
@every_approximation
def test_the_closed_form_gradient_is_that_of_finite_differences(
    approximation, Z, U, log_kernel, X, weights, kernel
):
    def value(*variables):
        rest = X, COLUMNS, FLOOR, approximation, weights, kernel
        return sparse_negative_log_likelihood(*variables, *rest)

    assert torch.autograd.gradcheck(value, (Z, U, log_kernel))


def test_the_variational_value_is_a_bound_that_more_inducing_positions_tighten(Z, log_kernel, X):
    exact = negative_log_likelihood(Z, log_kernel, X, COLUMNS, FLOOR)
    bounds = [
        sparse_negative_log_likelihood(Z, Z.detach()[:m], log_kernel, X, COLUMNS, FLOOR).item()
        for m in (2, 6, 12, 20, 24)
    ]
    assert bounds == sorted(bounds, reverse=True)
    assert bounds[-1] > exact.item() - 1e-9


@every_approximation
def test_a_row_of_weight_two_counts_as_two_rows(approximation, Z, U, log_kernel, X):
    doubled = torch.ones(24, dtype=torch.float64)
    doubled[:6] = 2.0
    once = sparse_negative_log_likelihood(
        Z, U, log_kernel, X, COLUMNS, FLOOR, approximation, doubled
    )
    twice = sparse_negative_log_likelihood(
        torch.cat([Z, Z[:6]]),
        U,
        log_kernel,
        torch.cat([X, X[:6]]),
        COLUMNS,
        FLOOR,
        approximation,
    )
    torch.testing.assert_close(once, twice, rtol=1e-12, atol=0.0)


@every_approximation
def test_the_compact_factor_changes_nothing(approximation, Z, U, log_kernel, X):
    low_rank = X[:, :2] @ normal(2, 9, seed=3)
    full, compact = (
        sparse_negative_log_likelihood(Z, U, log_kernel, F, 9, FLOOR, approximation)
        for F in (low_rank, compact_factor(low_rank))
    )
    torch.testing.assert_close(compact, full, rtol=1e-12, atol=0.0)


@every_approximation
def test_neither_the_order_of_rows_nor_that_of_inducing_positions_matters(
    approximation, Z, U, log_kernel, X, weights
):
    rows, order = torch.arange(23, -1, -1), torch.arange(5, -1, -1)
    forward = sparse_negative_log_likelihood(
        Z, U, log_kernel, X, COLUMNS, FLOOR, approximation, weights
    )
    backward = sparse_negative_log_likelihood(
        Z[rows], U[order], log_kernel, X[rows], COLUMNS, FLOOR, approximation, weights[rows]
    )
    torch.testing.assert_close(backward, forward, rtol=1e-9, atol=0.0)


def test_where_the_noise_goes_to_zero_fitc_hardly_minds(Z, U, log_kernel):
    """Its diagonal does the work of the noise: why FITC needs a floor."""
    observed = normal(24, 40, seed=4)

    def value(approximation, log_noise):
        kernel = torch.tensor([0.0, 0.0, log_noise], dtype=torch.float64)
        return sparse_negative_log_likelihood(Z, U, kernel, observed, 40, 0.0, approximation)

    rise = {name: value(name, -12.0) - value(name, -1.0) for name in APPROXIMATIONS}
    assert rise["fitc"] < 0.01 * rise["vfe"]


@every_approximation
def test_the_floor_adds_to_the_noise(approximation, Z, U, log_kernel, X):
    raised = log_kernel.detach().clone()
    raised[2] = (raised[2].exp() + FLOOR).log()
    with_floor = sparse_negative_log_likelihood(Z, U, log_kernel, X, COLUMNS, FLOOR, approximation)
    without = sparse_negative_log_likelihood(Z, U, raised, X, COLUMNS, 0.0, approximation)
    torch.testing.assert_close(with_floor, without)


def test_inducing_positions_that_coincide_do_no_harm(Z, log_kernel, X):
    U = Z.detach()[:3]
    one = sparse_negative_log_likelihood(Z, U, log_kernel, X, COLUMNS, FLOOR)
    repeated = sparse_negative_log_likelihood(Z, U.repeat(2, 1), log_kernel, X, COLUMNS, FLOOR)
    torch.testing.assert_close(repeated, one, rtol=1e-6, atol=0.0)


def test_parameters_that_overflow_raise(Z, U, X):
    far = torch.full((3,), 1000.0, dtype=torch.float64)
    with pytest.raises(NumericalError):
        sparse_negative_log_likelihood(Z, U, far, X, COLUMNS)
