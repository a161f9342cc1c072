import numpy as np
import pytest

import facert
from facert.data.take import Controls
from facert.pages.desk import KEPT, Desk, slider_bounds
from facert.posing.pose import known_poses

NAMES = ["jaw", "smile", "brow", "blink"]


@pytest.fixture(scope="module")
def character(make_take):
    return known_poses(make_take())


@pytest.fixture
def desk(character) -> Desk:
    return Desk(*character)


def test_the_others_follow_as_pose_completion_has_it(desk, make_take) -> None:
    desk.pin(0, 0.2)
    desk.pin(2, -0.1)
    expected = facert.complete_pose(make_take(), {"jaw": 0.2, "brow": -0.1})
    np.testing.assert_allclose(desk.pose, expected.pose)
    np.testing.assert_allclose(desk.std, expected.std)


def test_what_is_pinned_stays_exactly_and_has_no_doubt(desk) -> None:
    desk.pin(1, 0.123)
    desk.pin(3, 0.05)
    assert desk.pose[[1, 3]].tolist() == [0.123, 0.05]
    assert desk.std[[1, 3]].tolist() == [0.0, 0.0]
    assert (desk.std[[0, 2]] > 0).all()


def test_pins_at_once_and_one_by_one_come_to_the_same(desk, character) -> None:
    other = Desk(*character)
    other.pin(0, 0.2)
    other.pin(1, 0.1)
    desk.pin_all({0: 0.2, 1: 0.1})
    np.testing.assert_array_equal(desk.pose, other.pose)


def test_order_of_pins_does_not_matter_and_letting_go_undoes(desk, character) -> None:
    other = Desk(*character)
    desk.pin(0, 0.2)
    once = desk.pose.copy()
    desk.pin(2, 0.1)
    other.pin(2, 0.1)
    other.pin(0, 0.2)
    np.testing.assert_allclose(desk.pose, other.pose)
    desk.let_go(2)
    np.testing.assert_allclose(desk.pose, once)
    desk.let_all_go()
    np.testing.assert_array_equal(desk.pose, desk.rest)


def test_a_pose_to_begin_with_is_corrected_and_else_left_alone(desk) -> None:
    start = desk.known.poses[4]
    desk.begin(start, np.full(4, 0.1))
    np.testing.assert_array_equal(desk.pose, start)
    desk.pin(0, start[0])
    np.testing.assert_allclose(desk.pose, start)
    desk.pin(0, start[0] + 0.1)
    moved = np.abs(desk.pose - start)
    assert moved[0] == pytest.approx(0.1)
    assert (moved <= 0.1 + 1e-9).all()


def test_an_adopted_sample_stays_as_it_was_shown(desk) -> None:
    desk.pin(0, 0.2)
    samples = desk.samples(3, seed=1)
    assert samples.shape == (3, 4)
    assert (samples[:, 0] == 0.2).all()
    desk.adopt(samples[1])
    np.testing.assert_allclose(desk.pose, samples[1])
    assert desk.pins == {0: 0.2}


def test_without_known_poses_nothing_follows() -> None:
    desk = Desk(Controls(NAMES))
    desk.pin(1, 0.4)
    assert desk.pose.tolist() == [0.0, 0.4, 0.0, 0.0]
    assert not len(desk.samples(3, 0))
    assert not desk.far


def test_far_from_all_that_is_known_it_says_so(desk) -> None:
    desk.pin(0, 0.1)
    assert not desk.far
    desk.pin(0, 30.0)
    assert desk.far


def test_completions_are_kept_but_not_without_end(desk) -> None:
    rng = np.random.default_rng(0)
    for _ in range(3 * KEPT):
        desk.pin(int(rng.integers(4)), 0.1)
        desk.let_go(int(rng.integers(4)))
    assert len(desk._completions) <= KEPT


def test_sliders_reach_limits_or_all_that_is_known(desk, character) -> None:
    bounds, known = slider_bounds(desk), character[1].poses
    assert (bounds[:, 0] <= np.minimum(known.min(axis=0), 0)).all()
    assert (bounds[:, 1] >= np.maximum(known.max(axis=0), 1)).all()
    limits = np.array([[-1.0, 1], [0, np.inf], [-np.inf, 2], [0, 1]])
    limited = slider_bounds(Desk(Controls(NAMES, limits)))
    assert limited.tolist() == [[-1, 1], [0, 1], [0, 2], [0, 1]]
