import warnings

import numpy as np
import pytest
from scipy.optimize import check_grad
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

from facert.models.gp.hyperparameters import (
    NO_LINEAR_TERM,
    _Profile,
    maximise_likelihood,
)
from facert.models.kernels import RegressionKernel


def data(n=25, q=12, d=5, noise=0.1, seed=0):
    rng = np.random.default_rng(seed)
    latent = rng.normal(size=(n, 3))
    X = latent @ rng.normal(size=(3, q)) / 2.0
    Y = np.sin(latent @ rng.normal(size=(3, d))) + 0.3 * latent @ rng.normal(size=(3, d))
    return X, Y + noise * rng.normal(size=Y.shape)


def log_likelihood(X, Y, kernel):
    """By the definition."""
    K = kernel.gram(X)
    value = -0.5 * np.sum(Y * np.linalg.solve(K, Y))
    return value - 0.5 * Y.shape[1] * np.linalg.slogdet(2.0 * np.pi * K)[1]


def sklearn_best(X, Y, linear):
    kernel = ConstantKernel(1.0, (1e-5, 1e6)) * RBF(3.0, (1e-2, 1e4))
    if linear:
        kernel += ConstantKernel(1.0, (1e-6, 1e4)) * DotProduct(0.0, "fixed")
    kernel += WhiteKernel(1e-2, (1e-9, 1e2))
    model = GaussianProcessRegressor(kernel, n_restarts_optimizer=4, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        return model.fit(X, Y)


@pytest.mark.parametrize("bounds", [NO_LINEAR_TERM, (-20.0, 20.0)])
@pytest.mark.parametrize("v", [(-1.0, -3.0, 0.5), (2.0, -8.0, -3.0), (-4.0, 1.0, 4.0)])
def test_the_gradient_is_that_of_the_value(v, bounds):
    v = np.clip(v, *np.transpose([(-20.0, 20.0), (-20.0, 20.0), bounds]))
    profile = _Profile(*data())
    error = check_grad(lambda v: profile(v)[0], lambda v: profile(v)[1], v)
    assert error < 1e-5 * np.linalg.norm(profile(v)[1])


@pytest.mark.parametrize("v", [(-1.0, -3.0, 0.5), (2.0, -8.0, -1e3)])
def test_the_profile_is_the_likelihood_at_the_best_scale(v):
    X, Y = data()
    profile = _Profile(X, Y)
    kernel = profile.kernel(np.array(v))
    best = log_likelihood(X, Y, kernel)
    np.testing.assert_allclose(-profile(np.array(v))[0], best, rtol=1e-9)
    for factor in (0.9, 1.1):
        other = RegressionKernel(
            factor * kernel.variance,
            kernel.inverse_width,
            factor * kernel.noise,
            factor * kernel.linear,
        )
        assert log_likelihood(X, Y, other) < best


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("noise", [1e-3, 0.1])
def test_it_is_optimised_as_well_as_by_scikit_learn(linear, noise):
    X, Y = data(noise=noise)
    theirs = sklearn_best(X, Y, linear).log_marginal_likelihood_value_
    bounds = (-14.0, 14.0) if linear else NO_LINEAR_TERM
    found = maximise_likelihood(X, Y, bounds)
    assert found.value > theirs - 1e-3 * abs(theirs)
    np.testing.assert_allclose(log_likelihood(X, Y, found.kernel), found.value, rtol=1e-6)


def test_without_the_linear_term_there_is_none():
    assert maximise_likelihood(*data(), NO_LINEAR_TERM).kernel.linear == 0.0


def test_a_linear_truth_is_told_by_the_linear_term():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(30, 6))
    Y = X @ rng.normal(size=(6, 4)) + 0.05 * rng.normal(size=(30, 4))
    kernel = maximise_likelihood(X, Y).kernel
    assert kernel.linear > 0.1
    # What the smooth term makes of the difference of two frames is small beside it.
    assert kernel.variance * min(1.0, kernel.inverse_width) < 0.1 * kernel.linear
    assert kernel.noise == pytest.approx(0.05**2, rel=0.5)


@pytest.mark.parametrize(("of_source", "of_target"), [(1e-3, 1.0), (30.0, 1e3)])
def test_units_of_source_and_target_do_not_matter(of_source, of_target):
    X, Y = data()
    expected, found = (
        maximise_likelihood(*views).kernel for views in ((X, Y), (of_source * X, of_target * Y))
    )
    assert found.variance == pytest.approx(of_target**2 * expected.variance, rel=1e-2)
    assert found.inverse_width == pytest.approx(expected.inverse_width / of_source**2, rel=1e-2)
    assert found.noise == pytest.approx(of_target**2 * expected.noise, rel=1e-2)


@pytest.mark.parametrize("kind", ["frames", "poses", "nothing"])
def test_labels_that_are_all_the_same_do_no_harm(kind):
    X, Y = data(n=6)
    X = np.zeros_like(X) if kind == "frames" else X
    Y = np.ones_like(Y) if kind == "poses" else Y
    Y = np.zeros_like(Y) if kind == "nothing" else Y
    kernel = maximise_likelihood(X, Y).kernel
    assert kernel.noise > 0
    assert np.isfinite(kernel.gram(X)).all()
