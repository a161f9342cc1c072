import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from facert.models.gp.posterior import Posterior
from facert.models.kernels import KERNELS, SquaredExponential

THETA = {"variance": 1.4, "inverse_width": 0.5, "noise": 0.05}
KERNEL = SquaredExponential(**THETA)
STEP = 1e-6


def make_posterior(kernel):
    rng = np.random.default_rng(0)
    Z = rng.normal(size=(20, 2))
    return Posterior(Z, np.sin(Z @ rng.normal(size=(2, 4))), kernel)


@pytest.fixture
def posterior():
    return make_posterior(KERNEL)


@pytest.fixture
def z():
    return np.random.default_rng(1).normal(size=(7, 2))


def differences(function, z):
    """Central differences of function(z) (B, ...) by each column of z, (B, q, ...)."""
    steps = STEP * np.eye(z.shape[1])
    return np.stack([(function(z + s) - function(z - s)) / (2 * STEP) for s in steps], axis=1)


def test_mean_and_std_are_those_of_scikit_learn_with_the_noise_included(posterior, z):
    kernel = ConstantKernel(1.4) * RBF(0.5**-0.5) + WhiteKernel(0.05)
    model = GaussianProcessRegressor(kernel, alpha=0.0, optimizer=None)
    model.fit(posterior.Z, posterior.X)
    mean, std = model.predict(z, return_std=True)
    at = posterior.predict(z)
    np.testing.assert_allclose(at.mean, mean, rtol=1e-9)
    np.testing.assert_allclose(np.sqrt(at.variance), std[:, 0], rtol=1e-9)


def test_a_batch_equals_one_by_one(posterior, z):
    at = posterior.predict(z)
    for row in range(len(z)):
        alone = posterior.predict(z[row : row + 1])
        np.testing.assert_allclose(alone.mean[0], at.mean[row], rtol=1e-12)
        np.testing.assert_allclose(alone.variance[0], at.variance[row], rtol=1e-12)


def test_far_away_the_prediction_is_the_prior(posterior):
    at = posterior.predict(np.full((1, 2), 100.0))
    np.testing.assert_allclose(at.mean, 0.0, atol=1e-12)
    assert at.variance[0] == pytest.approx(KERNEL.variance + KERNEL.noise)


def test_the_variance_never_falls_below_the_noise(posterior):
    assert (posterior.predict(posterior.Z).variance >= KERNEL.noise).all()


@pytest.mark.parametrize("name", KERNELS)
def test_jacobians_agree_with_finite_differences(name, z):
    posterior = make_posterior(KERNELS[name](**THETA))
    G, H, J = posterior.jacobians(posterior.predict(z))
    by_field = {
        name: differences(lambda z, name=name: getattr(posterior.predict(z), name), z)
        for name in ("k", "whitened", "mean")
    }
    np.testing.assert_allclose(G, by_field["k"], atol=1e-7)
    np.testing.assert_allclose(H, by_field["whitened"], atol=1e-7)
    np.testing.assert_allclose(J, by_field["mean"], atol=1e-7)


def test_solve_divides_by_the_training_matrix(posterior, z):
    at = posterior.predict(z)
    np.testing.assert_allclose(posterior.solve(at) @ KERNEL.gram(posterior.Z), at.k, atol=1e-12)


def test_with_little_noise_the_variance_keeps_its_digits(posterior):
    """At a training position σ² = noise (2 - noise (K⁻¹)_ii), however small the noise."""
    kernel = SquaredExponential(variance=1.0, inverse_width=0.5, noise=1e-7)
    Z = posterior.Z
    precision = np.diag(np.linalg.inv(kernel.gram(Z).astype(np.longdouble).astype(float)))
    expected = kernel.noise * (2.0 - kernel.noise * precision)
    np.testing.assert_allclose(
        Posterior(Z, posterior.X, kernel).predict(Z).variance, expected, rtol=1e-4
    )
