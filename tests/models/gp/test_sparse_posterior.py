import numpy as np
import pytest

from facert.models.gp.posterior import Posterior
from facert.models.gp.sparse import APPROXIMATIONS
from facert.models.gp.sparse_posterior import sparse_posterior
from facert.models.kernels import SquaredExponential

KERNEL = SquaredExponential(variance=1.4, inverse_width=0.5, noise=0.05)

every_approximation = pytest.mark.parametrize("approximation", APPROXIMATIONS)


def observations(n, seed=0):
    rng = np.random.default_rng(seed)
    Z = rng.normal(size=(n, 2))
    return Z, np.sin(Z @ np.random.default_rng(9).normal(size=(2, 4)))


@pytest.fixture
def z():
    return np.random.default_rng(1).normal(size=(7, 2))


@every_approximation
def test_where_every_row_is_inducing_it_is_the_exact_process(approximation, z):
    Z, X = observations(25)
    exact = Posterior(Z, X, KERNEL).predict(z)
    sparse = sparse_posterior(Z, Z, X, KERNEL, approximation).predict(z)
    np.testing.assert_allclose(sparse.mean, exact.mean, atol=1e-7)
    np.testing.assert_allclose(sparse.variance, exact.variance, atol=1e-7)


@every_approximation
def test_a_few_inducing_positions_come_close_to_the_process_of_many_rows(approximation, z):
    Z, X = observations(400)
    exact = Posterior(Z, X, KERNEL).predict(z)
    sparse = sparse_posterior(Z[:60], Z, X, KERNEL, approximation).predict(z)
    np.testing.assert_allclose(sparse.mean, exact.mean, atol=0.02)
    np.testing.assert_allclose(sparse.variance, exact.variance, atol=0.02)


def test_it_is_as_large_as_its_inducing_positions_however_many_rows():
    Z, X = observations(300)
    made = sparse_posterior(Z[:12], Z, X, KERNEL)
    assert (made.Z.shape, made.whitener.shape, made.alpha.shape) == ((12, 2), (12, 12), (12, 4))
    assert made.columns == 4


def test_a_row_of_weight_two_counts_as_two_rows(z):
    Z, X = observations(30)
    doubled = np.r_[np.full(10, 2.0), np.ones(20)]
    once = sparse_posterior(Z[:8], Z, X, KERNEL, weights=doubled).predict(z)
    Z_twice, X_twice = np.vstack([Z, Z[:10]]), np.vstack([X, X[:10]])
    twice = sparse_posterior(Z[:8], Z_twice, X_twice, KERNEL).predict(z)
    np.testing.assert_allclose(once.mean, twice.mean, atol=1e-10)
    np.testing.assert_allclose(once.variance, twice.variance, atol=1e-10)


@every_approximation
def test_far_away_the_prediction_is_the_prior(approximation):
    Z, X = observations(30)
    at = sparse_posterior(Z[:8], Z, X, KERNEL, approximation).predict(np.full((1, 2), 100.0))
    np.testing.assert_allclose(at.mean, 0.0, atol=1e-12)
    assert at.variance[0] == pytest.approx(KERNEL.variance + KERNEL.noise)
