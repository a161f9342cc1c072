"""Features of the source learned from every frame."""

import numpy as np
import pytest

from facert.models.whitening import noise_variance, whitening


def frames(n=2000, d=12, rank=4, noise=0.0, seed=0):
    """Frames that move in a few directions, each a third as far as the one before."""
    rng = np.random.default_rng(seed)
    directions, _ = np.linalg.qr(rng.normal(size=(d, d)))
    signal = rng.normal(size=(n, rank)) * 3.0 ** -np.arange(rank)
    return signal @ directions[:, :rank].T + noise * rng.normal(size=(n, d))


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0])
def test_whitening_divides_each_direction_by_a_power_of_its_deviation(power):
    X = frames()
    phi = (X - X.mean(axis=0)) @ whitening(X, power)
    deviations = np.sort(phi.std(axis=0))[::-1][:4]
    raw = np.sqrt(np.sort(np.linalg.eigvalsh(np.cov(X.T, bias=True)))[::-1][:4])

    np.testing.assert_allclose(deviations, raw ** (1.0 - power), rtol=0.02)


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("rank", "noise", "n"), [(4, 0.05, 400), (9, 0.0, 400), (5, 0.02, 60)])
def test_a_feature_is_the_best_linear_estimate_from_its_direction_over_a_power(
    rank, noise, n, power
):
    """Over the directions that show more than noise would; Φ Φᵀ has no signs."""
    X = frames(n=n, rank=rank, noise=noise)
    variances, directions = np.linalg.eigh(np.cov(X.T, bias=True))
    of_noise, expected = np.median(variances), np.zeros((12, 12))
    for variance, v in zip(variances, directions.T, strict=True):
        if variance > of_noise * (1.0 + np.sqrt(12 / n)) ** 2:  # Marchenko and Pastur
            signal = variance - of_noise
            estimate = signal / (signal + of_noise + 1e-5 * variances[-1])
            expected += np.outer(v, v) * (estimate / signal ** (power / 2.0)) ** 2
    basis = whitening(X, power)
    np.testing.assert_allclose(basis @ basis.T, expected, atol=1e-9 * np.abs(expected).max())


def test_directions_of_noise_alone_are_left_out():
    X = frames(noise=0.01)

    assert np.count_nonzero(whitening(X, 0.5).any(axis=0)) == 4


def test_noise_is_known_from_the_directions_without_motion():
    X = frames(noise=0.05)
    variances = np.linalg.eigvalsh(np.cov(X.T))

    assert noise_variance(variances) == pytest.approx(0.05**2, rel=0.1)


@pytest.mark.parametrize("d", [1, 2])
def test_of_one_or_two_directions_none_is_taken_for_noise(d):
    X = frames(d=d, rank=d)
    np.testing.assert_allclose(np.linalg.matrix_rank(whitening(X, 0.5)), d)


def test_features_turn_with_the_source():
    X = frames(noise=0.01)
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(12, 12)))
    phi, turned = X @ whitening(X, 0.5), (X @ turn) @ whitening(X @ turn, 0.5)

    np.testing.assert_allclose(phi @ phi.T, turned @ turned.T, atol=1e-9)
