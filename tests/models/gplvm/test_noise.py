import numpy as np
import pytest

from facert.methods.noise import LEAST, MOST, expected_noise


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
