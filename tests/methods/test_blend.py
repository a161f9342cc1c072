"""Features from all frames, shrinkage by all poses."""

from __future__ import annotations

import numpy as np
import pytest

from facert.methods.base import Labelled, Unlabelled
from facert.methods.blend import SemiSupervisedGPR, blend_weights
from facert.methods.features import noise_variance, whitening
from facert.methods.linear import leave_one_out_ridge
from facert.methods.shrinkage import shrinkage
from facert.settings import Settings


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


def test_directions_of_noise_alone_are_left_out():
    X = frames(noise=0.01)

    assert np.count_nonzero(whitening(X, 0.5).any(axis=0)) == 4


def test_noise_is_known_from_the_directions_without_motion():
    X = frames(noise=0.05)
    variances = np.linalg.eigvalsh(np.cov(X.T))

    assert noise_variance(variances) == pytest.approx(0.05**2, rel=0.1)


def test_features_turn_with_the_source():
    X = frames(noise=0.01)
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(12, 12)))
    phi, turned = X @ whitening(X, 0.5), (X @ turn) @ whitening(X @ turn, 0.5)

    np.testing.assert_allclose(phi @ phi.T, turned @ turned.T, atol=1e-9)


def test_a_perfect_regression_is_not_shrunk_and_a_useless_one_becomes_the_mean():
    poses = np.random.default_rng(0).normal(size=(200, 5))

    np.testing.assert_allclose(shrinkage(poses, np.zeros((20, 5))), np.eye(5), atol=1e-5)
    np.testing.assert_allclose(shrinkage(poses, np.full((20, 5), 1e4)), 0.0, atol=1e-6)


def test_a_control_that_is_predicted_badly_is_told_by_the_one_it_goes_with():
    x = np.random.default_rng(0).normal(size=500)
    poses = np.column_stack([x, 2.0 * x])
    errors = np.tile([0.01, 100.0], (20, 1))

    np.testing.assert_allclose([1.0, 0.0] @ shrinkage(poses, errors), [1.0, 2.0], rtol=0.01)


def test_more_unlabelled_frames_and_poses_help():
    rng = np.random.default_rng(3)
    X = frames(n=400, d=30, rank=8, noise=0.02, seed=3)
    Y = np.tanh(X @ rng.normal(size=(30, 6)))

    def error(count):
        method = SemiSupervisedGPR(Settings(method="ssgpr"))
        method.fit(Labelled(X[:12], Y[:12]), Unlabelled(X[12 : 12 + count], Y[12 : 12 + count]))
        return np.sqrt(np.mean((method.predict(X[212:]).Y - Y[212:]) ** 2))

    assert error(200) < 0.95 * error(0)


def test_weights_are_shares():
    errors = list(np.random.default_rng(0).normal(size=(4, 10, 3)))
    weights = blend_weights(errors)

    assert weights.sum() == pytest.approx(1.0)
    assert (weights >= 0).all()


def test_experts_that_are_alike_share_alike_and_a_far_better_one_takes_all():
    error = np.random.default_rng(0).normal(size=(10, 3))

    np.testing.assert_allclose(blend_weights([error, error, error]), 1 / 3)
    np.testing.assert_allclose(blend_weights([0.01 * error, error]), [1.0, 0.0], atol=1e-3)


def test_experts_that_err_in_opposite_ways_are_mixed():
    error = np.random.default_rng(0).normal(size=(10, 3))

    np.testing.assert_allclose(blend_weights([error, -error]), [0.5, 0.5])


def test_ridge_knows_what_it_misses_of_a_row_that_is_left_out():
    rng = np.random.default_rng(1)
    X, Y = rng.normal(size=(15, 6)), rng.normal(size=(15, 2))
    found = leave_one_out_ridge(X, Y)
    penalties = found.penalties * np.sum(X * X) / len(X)

    for row in range(len(X)):
        kept = np.arange(len(X)) != row
        for control, penalty in enumerate(penalties):
            gram = X[kept].T @ X[kept] + penalty * np.eye(6)
            weights = np.linalg.solve(gram, X[kept].T @ Y[kept, control])
            missed = Y[row, control] - X[row] @ weights
            assert found.left_out_errors[row, control] == pytest.approx(missed, rel=1e-6)
