"""Poses at a limit, against SciPy's truncated normal distribution and numerical integration."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm, truncnorm

from facert.models.factors.censoring import CensoredPoses, CensoringLimits, ClippedMean


def limits(low, high):
    return CensoringLimits(np.array([low]), np.array([high]))


@pytest.mark.parametrize("std", [0.12, 1.0, 3.0])
@pytest.mark.parametrize("mean", [-8.0, -1.0, 0.0, 0.4, 5.0])
def test_what_is_behind_a_limit_is_a_truncated_normal_variable(mean, std):
    for value, known, (a, b) in (
        (0.0, limits(0.0, np.inf), (-np.inf, 0.0)),
        (1.0, limits(-np.inf, 1.0), (1.0, np.inf)),
    ):
        poses = CensoredPoses.of(np.array([[value]]), known)
        free, variance = poses.free(np.array([[mean]]), np.array([std]))
        expected = truncnorm((a - mean) / std, (b - mean) / std, mean, std)
        np.testing.assert_allclose(free[0, 0], expected.mean(), rtol=1e-6)
        np.testing.assert_allclose(variance[0], expected.var(), rtol=1e-3, atol=1e-12)


def test_far_beyond_a_limit_nothing_is_lost_to_rounding():
    poses = CensoredPoses.of(np.zeros((1, 1)), limits(0.0, np.inf))
    free, variance = poses.free(np.array([[1000.0]]), np.array([1.0]))
    np.testing.assert_allclose(free, -1e-3, rtol=1e-3)
    assert 0.0 <= variance[0] < 1e-4


def test_poses_between_the_limits_are_known():
    poses = np.array([[0.0, 0.2], [0.7, 1.0], [1.0, 0.5]])
    known = CensoringLimits(np.array([0.0, -np.inf]), np.array([np.inf, 1.0]))
    free, variance = CensoredPoses.of(poses, known).free(np.full((3, 2), 0.5), np.ones(2))

    np.testing.assert_array_equal(free != poses, [[True, False], [False, True], [False, False]])
    assert free[0, 0] < 0.0
    assert free[1, 1] > 1.0
    assert (variance > 0).all()


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, np.inf), (-np.inf, 1.0), (0.0, 1.0), (-np.inf, np.inf)]
)
@pytest.mark.parametrize("mean", [-3.0, 0.1, 0.5, 4.0])
@pytest.mark.parametrize("std", [0.2, 1.5])
def test_the_expected_pose_is_the_mean_of_the_clipped_one(low, high, mean, std):
    expected, _ = quad(
        lambda y: np.clip(y, low, high) * norm.pdf(y, mean, std),
        mean - 12.0 * std,
        mean + 12.0 * std,
        points=[limit for limit in (low, high) if abs(limit - mean) < 12.0 * std] or None,
    )
    found = ClippedMean(limits(low, high), np.array([std]))(np.array([[mean]]))
    np.testing.assert_allclose(found[0, 0], expected, atol=1e-7)


def test_a_limit_is_where_poses_pile_up():
    rng = np.random.default_rng(0)
    inside = rng.uniform(0.1, 0.9, 100)
    half_closed = np.where(rng.random(100) < 0.5, 0.0, inside)
    often_open = np.where(rng.random(100) < 0.5, 1.0, inside)
    rarely_closed = np.where(np.arange(100) < 10, 0.0, inside)
    poses = np.column_stack([inside, half_closed, often_open, rarely_closed, np.full(100, 0.3)])
    found = CensoringLimits.of(poses)

    np.testing.assert_array_equal(found.low, [-np.inf, 0.0, -np.inf, -np.inf, -np.inf])
    np.testing.assert_array_equal(found.high, [np.inf, np.inf, 1.0, np.inf, np.inf])


def test_of_a_few_poses_the_lowest_and_the_highest_are_no_limits():
    found = CensoringLimits.of(np.random.default_rng(0).normal(size=(4, 3)))
    assert np.isneginf(found.low).all()
    assert np.isposinf(found.high).all()
