"""Shrinkage of predictions by all poses."""

import numpy as np

from facert.methods.shrinkage import Shrinkage


def test_a_perfect_regression_is_not_shrunk_and_a_useless_one_becomes_the_mean():
    poses = np.random.default_rng(0).normal(size=(200, 5))
    perfect = Shrinkage.learn(poses, np.zeros((20, 5)))
    useless = Shrinkage.learn(poses, np.full((20, 5), 1e4))

    np.testing.assert_allclose(perfect(poses), poses, atol=1e-4)
    np.testing.assert_allclose(useless(poses), np.tile(poses.mean(axis=0), (200, 1)), atol=1e-6)


def test_a_control_that_is_predicted_badly_follows_the_one_it_goes_with():
    x = np.random.default_rng(0).normal(size=500)
    poses = np.column_stack([x, 2.0 * x])
    shrinkage = Shrinkage.learn(poses, np.tile([0.01, 100.0], (20, 1)))
    away = np.array([[1.0, -50.0], [0.0, 50.0]])
    shrunk = shrinkage(shrinkage.mean + away) - shrinkage.mean

    np.testing.assert_allclose(shrunk, [[1.0, 2.0], [0.0, 0.0]], atol=0.05)


def test_it_is_the_most_probable_pose():
    """The minimum of (y - ȳ)ᵀ C⁻¹ (y - ȳ) + (p - y)ᵀ R⁻¹ (p - y)."""
    rng = np.random.default_rng(0)
    poses, errors = rng.normal(size=(50, 3)) @ rng.normal(size=(3, 3)), rng.normal(size=(9, 3))
    C, R = np.cov(poses.T, bias=True), np.diag(np.mean(errors**2, axis=0))
    predicted, mean = rng.normal(size=(4, 3)), poses.mean(axis=0)
    found = Shrinkage.learn(poses, errors)(predicted)
    slope = np.linalg.solve(C, (found - mean).T) - np.linalg.solve(R, (predicted - found).T)

    np.testing.assert_allclose(slope, 0.0, atol=1e-4)


def test_poses_that_are_all_the_same_are_what_everything_becomes():
    same = np.full((10, 2), 0.25)
    shrinkage = Shrinkage.learn(same, np.zeros((3, 2)))
    np.testing.assert_allclose(shrinkage(np.ones((4, 2))), 0.25)
