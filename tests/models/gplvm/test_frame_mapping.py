"""One frame at a time is mapped as in a batch, and never ends in a worse place."""

import numpy as np
import pytest

from facert.models.gp.posterior import Posterior
from facert.models.gplvm.frame_mapping import FrameMapping
from facert.models.gplvm.source_mapping import Observation
from facert.models.kernels import KERNELS

THETA = {"variance": 1.2, "inverse_width": 0.5, "noise": 0.02}
LATENT, COLUMNS = 3, 9


@pytest.fixture(scope="module", params=KERNELS)
def mapping(request):
    rng = np.random.default_rng(0)
    Z = rng.normal(size=(25, LATENT))
    X = np.sin(Z @ rng.normal(size=(LATENT, COLUMNS)))
    return FrameMapping(Posterior(Z, X, KERNELS[request.param](**THETA)))


def performance(mapping, missing, frames=200):
    """A smooth path through the latent space as the source view shows it, with noise and gaps."""
    rng = np.random.default_rng(1)
    time = np.linspace(0.0, 6.0, frames)[:, None]
    clean = mapping.view.predict(np.sin(time * [1.0, 1.7, 2.3])).mean
    observed = clean + 0.05 * rng.normal(size=clean.shape)
    observed[rng.random(observed.shape) < missing] = np.nan
    return Observation.of(observed, 0.1)


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_energy_gradient_and_hessian_are_those_of_the_batch(mapping, missing):
    observed = performance(mapping, missing, frames=20)
    Z = np.random.default_rng(2).normal(size=(20, LATENT))
    batch = mapping._expand(Z, observed)
    for row, z in enumerate(Z):
        of_frame = observed.mean[row], observed.variance[row]
        energy, gradient, hessian = mapping.expand_frame(mapping.linearise(z), *of_frame)
        assert energy == mapping.frame_energy(z, *of_frame)
        assert energy == pytest.approx(batch.energy[row], rel=1e-12)
        for ours, theirs in ((gradient, batch.gradient[row]), (hessian, batch.hessian[row])):
            np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_following_ends_nowhere_worse_than_the_best_of_many_starts(mapping, missing):
    """In 99 of 100 frames: each of the others has a second minimum that its past led to."""
    observed = performance(mapping, missing)
    starts = np.random.default_rng(3).normal(size=(10, len(observed.mean), LATENT))
    best = np.min([mapping.solve(observed, start).energy for start in starts], axis=0)
    mapped = mapping.solve(observed[:1])
    worse = 0
    for row in range(len(best)):
        mapped = mapping.follow(observed[row : row + 1], mapped.z)
        worse += mapped.energy[0] > best[row] + 1e-5
    assert worse <= 0.01 * len(best)


def test_following_comes_to_where_the_batch_comes_from_the_same_start(mapping):
    observed = performance(mapping, 0.2)
    batch = mapping.solve(observed)
    for row in range(0, len(batch.z), 7):
        alone = mapping.follow(observed[row : row + 1], batch.z[row : row + 1])
        np.testing.assert_allclose(alone.z[0], batch.z[row], atol=1e-4)
        np.testing.assert_allclose(alone.x[0], batch.x[row], atol=1e-4)
        scale = np.abs(batch.hessian[row]).max()
        np.testing.assert_allclose(alone.hessian[0], batch.hessian[row], atol=0.01 * scale)


def test_a_previous_frame_that_is_no_help_does_no_harm(mapping):
    observed = performance(mapping, 0.0, frames=30)
    batch = mapping.solve(observed)
    far = np.full((1, LATENT), 6.0)
    for row in range(30):
        alone = mapping.follow(observed[row : row + 1], far)
        assert alone.converged.all()
        assert alone.energy[0] == pytest.approx(batch.energy[row], abs=1e-6)


def test_descent_is_refused_above_the_energy_given_and_on_a_saddle(mapping):
    observed = performance(mapping, 0.0, frames=1)
    b, R = observed.mean[0], observed.variance[0]
    (z,) = mapping.solve(observed).z
    least = mapping.frame_energy(z, b, R)
    assert mapping.descend(mapping.linearise(z), b, R, least + 1.0) is not None
    assert mapping.descend(mapping.linearise(z), b, R, least - 1.0) is None
    starts = np.random.default_rng(4).normal(scale=2.0, size=(200, LATENT))
    points = [mapping.linearise(start) for start in starts]
    curved = [s for s in points if np.linalg.eigvalsh(mapping.expand_frame(s, b, R)[2])[0] < 0]
    assert curved
    assert all(mapping.descend(at, b, R) is None for at in curved)


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_to_begin_where_the_frame_before_stood_is_as_good_as_to_begin_at_its_z(mapping, missing):
    observed = performance(mapping, missing, frames=40)
    mapped = mapping.solve(observed[:1])
    for row in range(1, 40):
        plain = mapping.follow(observed[row : row + 1], mapped.z)
        mapped = mapping.follow(observed[row : row + 1], mapped.z, mapped.linearised)
        np.testing.assert_allclose(mapped.z, plain.z, atol=1e-4)
        np.testing.assert_allclose(mapped.x, plain.x, atol=1e-4)
        assert mapped.energy[0] == pytest.approx(plain.energy[0], abs=1e-6)
