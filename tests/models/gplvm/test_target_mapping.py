import numpy as np
import pytest

from facert.models.gp.posterior import Posterior
from facert.models.gplvm.source_mapping import CHUNK, Mapped
from facert.models.gplvm.target_mapping import map_to_target
from facert.models.kernels import SquaredExponential

KERNEL = SquaredExponential(variance=1.0, inverse_width=0.5, noise=0.05)


@pytest.fixture
def posterior():
    rng = np.random.default_rng(0)
    Z = rng.normal(size=(15, 2))
    return Posterior(Z, np.sin(Z @ rng.normal(size=(2, 4))), KERNEL)


def mapped(z, certainty):
    """Frames at z whose latent positions are known with this precision."""
    hessian = np.broadcast_to(certainty * np.eye(2), (len(z), 2, 2))
    return Mapped(z, np.zeros((len(z), 3)), hessian, np.zeros(len(z)), np.ones(len(z), bool))


def test_parameters_are_the_posterior_mean_of_equation_18(posterior):
    z = np.random.default_rng(1).normal(size=(6, 2))
    k = KERNEL.cross(z, posterior.Z)
    mean, _ = map_to_target(posterior, mapped(z, 1.0))
    np.testing.assert_allclose(
        mean, k @ np.linalg.solve(KERNEL.gram(posterior.Z), posterior.X), atol=1e-12
    )


def test_at_a_certain_position_the_std_is_that_of_the_process(posterior):
    z = np.random.default_rng(1).normal(size=(6, 2))
    _, std = map_to_target(posterior, mapped(z, 1e12))
    np.testing.assert_allclose(std**2, posterior.predict(z).variance[:, None] * np.ones((1, 4)))


def test_the_less_certain_the_position_the_wider_the_std(posterior):
    z = np.random.default_rng(1).normal(size=(6, 2))
    narrow, wide = (map_to_target(posterior, mapped(z, certainty))[1] for certainty in (100, 10))
    assert (wide > narrow).all()


def test_the_std_is_that_of_samples_around_the_position(posterior):
    z, certainty = np.array([[0.3, -0.2]]), 400.0
    samples = z + np.random.default_rng(2).normal(size=(20_000, 2)) / certainty**0.5
    spread = posterior.predict(samples).mean.var(axis=0)
    _, std = map_to_target(posterior, mapped(z, certainty))
    np.testing.assert_allclose(std[0] ** 2, posterior.predict(z).variance + spread, rtol=0.01)


def test_many_frames_equal_few(posterior):
    z = np.random.default_rng(1).normal(size=(CHUNK + 3, 2))
    mean, std = map_to_target(posterior, mapped(z, 5.0))
    last_mean, last_std = map_to_target(posterior, mapped(z[-2:], 5.0))
    np.testing.assert_allclose(mean[-2:], last_mean)
    np.testing.assert_allclose(std[-2:], last_std)
