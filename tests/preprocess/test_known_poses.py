"""What poses are clipped to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.take import Controls
from facert.preprocess.known_poses import KnownPoses, pose_bounds

POSED = np.array([[0.0, 0.5, 0.1, 0.2], [0.4, 0.1, 0.3, 0.2]])


@pytest.fixture
def take(make_take):
    """Without declared limits, with animation."""
    return make_take()


def test_by_default_the_range_of_all_known_poses_bounds_a_control(take):
    known = np.vstack([POSED, take.animation])
    bounds = pose_bounds(take, POSED, "auto")
    np.testing.assert_array_equal(bounds, np.stack([known.min(axis=0), known.max(axis=0)], axis=1))
    np.testing.assert_array_equal(
        pose_bounds(replace(take, animation=None), POSED, "auto"),
        np.stack([POSED.min(axis=0), POSED.max(axis=0)], axis=1),
    )


def test_declared_limits_come_first_and_no_limits_are_none(take):
    limits = np.array([[-1.0, 2.0]] * 4)
    declared = replace(take, controls=Controls(take.controls.names, limits=limits))
    np.testing.assert_array_equal(pose_bounds(declared, POSED, "declared"), limits)
    assert pose_bounds(declared, POSED, "none") is None
    assert pose_bounds(take, POSED, "declared") is None


def test_clipping_moves_a_control_to_its_nearest_bound():
    known = KnownPoses(POSED, np.array([[0.0, 1.0], [-np.inf, 0.5], [0.2, np.inf], [0.0, 0.0]]))
    clipped = known.clip(np.array([[-1.0, -9.0, 0.1, 5.0], [2.0, 0.7, 9.0, -5.0]]))
    np.testing.assert_array_equal(clipped, [[0.0, -9.0, 0.2, 0.0], [1.0, 0.5, 9.0, 0.0]])


def test_a_limit_lets_a_control_go_half_its_range_beyond_its_poses_at_most(take):
    limits = np.array([[0.0, 1.0], [-1.0, 0.6], [-np.inf, np.inf], [0.5, 0.7]])
    declared = replace(take, controls=Controls(take.controls.names, limits), animation=None)
    bounds = pose_bounds(declared, POSED, "auto")
    np.testing.assert_allclose(bounds, [[0, 0.6], [-0.1, 0.6], [0.1, 0.3], [0.5, 0.5]])
