import numpy as np
import pytest

from facert.methods.noise import LEAST, MOST, expected_noise, with_noise
from facert.settings import Settings


def frames(deviations):
    """Uncorrelated columns with exactly these deviations."""
    columns, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(200, len(deviations) + 1)))
    centred = columns - columns.mean(axis=0)
    basis, _ = np.linalg.qr(centred[:, : len(deviations)])
    return basis * np.sqrt(200) * deviations


def test_the_first_direction_that_the_latent_space_cannot_carry_is_noise():
    X = frames(np.array([1.0, 0.5, 0.07, 0.05]))
    assert expected_noise(X, 2) == pytest.approx(0.07)
    assert expected_noise(X, 3) == pytest.approx(0.05)
    assert expected_noise(X + 9.0, 3) == pytest.approx(0.05)


def test_it_stays_between_sensible_bounds():
    X = frames(np.array([1.0, 0.5, 1e-6]))
    assert expected_noise(X, 1) == MOST
    assert expected_noise(X, 2) == LEAST
    assert expected_noise(X, 8) == LEAST


def test_left_open_the_noise_floor_of_the_source_is_the_variance_of_its_noise():
    X = frames(np.array([1.0, 0.5, 0.07, 0.05]))
    found = with_noise(Settings(latent_dim=2), X)
    assert found.sigma_c == pytest.approx(0.07)
    assert found.source_noise_floor == pytest.approx(0.07**2)
    given = with_noise(Settings(latent_dim=2, sigma_c=0.2), X)
    assert given.sigma_c == 0.2
    assert given.source_noise_floor == pytest.approx(0.2**2)
    assert with_noise(Settings(source_noise_floor=0.0), X).source_noise_floor == 0.0


def test_it_is_never_below_three_hundredths_nor_above_a_tenth_of_the_largest_deviation():
    """Below, source mapping sticks to training latents; above, small motion is lost."""
    X = frames(np.array([1.0, 0.5, 1e-6]))
    assert expected_noise(X, 1) == pytest.approx(0.1)
    assert expected_noise(X, 2) == pytest.approx(0.03)
