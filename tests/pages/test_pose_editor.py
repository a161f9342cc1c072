import numpy as np
import pytest

import facert
from facert.data.take import Controls
from facert.pages.pose_editor import KEPT, PoseEditor, slider_bounds
from facert.posing.completed_pose import known_poses

NAMES = ["jaw", "smile", "brow", "blink"]


@pytest.fixture(scope="module")
def character(make_take):
    return known_poses(make_take())


@pytest.fixture
def editor(character) -> PoseEditor:
    return PoseEditor(*character)


def test_the_others_follow_as_pose_completion_has_it(editor, make_take) -> None:
    editor.pin(0, 0.2)
    editor.pin(2, -0.1)
    expected = facert.complete_pose(make_take(), {"jaw": 0.2, "brow": -0.1})
    np.testing.assert_allclose(editor.pose, expected.pose)
    np.testing.assert_allclose(editor.std, expected.std)


def test_what_is_pinned_stays_exactly_and_has_no_variance(editor) -> None:
    editor.pin(1, 0.123)
    editor.pin(3, 0.05)
    assert editor.pose[[1, 3]].tolist() == [0.123, 0.05]
    assert editor.std[[1, 3]].tolist() == [0.0, 0.0]
    assert (editor.std[[0, 2]] > 0).all()


def test_pins_at_once_and_one_by_one_come_to_the_same(editor, character) -> None:
    other = PoseEditor(*character)
    other.pin(0, 0.2)
    other.pin(1, 0.1)
    editor.pin_all({0: 0.2, 1: 0.1})
    np.testing.assert_array_equal(editor.pose, other.pose)


def test_order_of_pins_does_not_matter_and_letting_go_undoes(editor, character) -> None:
    other = PoseEditor(*character)
    editor.pin(0, 0.2)
    once = editor.pose.copy()
    editor.pin(2, 0.1)
    other.pin(2, 0.1)
    other.pin(0, 0.2)
    np.testing.assert_allclose(editor.pose, other.pose)
    editor.let_go(2)
    np.testing.assert_allclose(editor.pose, once)
    editor.let_all_go()
    np.testing.assert_array_equal(editor.pose, editor.rest)


def test_a_pose_to_begin_with_is_corrected_and_else_left_alone(editor) -> None:
    start = editor.known.poses[4]
    editor.begin(start, np.full(4, 0.1))
    np.testing.assert_array_equal(editor.pose, start)
    editor.pin(0, start[0])
    np.testing.assert_allclose(editor.pose, start)
    editor.pin(0, start[0] + 0.1)
    moved = np.abs(editor.pose - start)
    assert moved[0] == pytest.approx(0.1)
    assert (moved <= 0.1 + 1e-9).all()


def test_an_adopted_sample_stays_as_it_was_shown(editor) -> None:
    editor.pin(0, 0.2)
    samples = editor.samples(3, seed=1)
    assert samples.shape == (3, 4)
    assert (samples[:, 0] == 0.2).all()
    editor.adopt(samples[1])
    np.testing.assert_allclose(editor.pose, samples[1])
    assert editor.pins == {0: 0.2}


def test_without_known_poses_nothing_follows() -> None:
    editor = PoseEditor(Controls(NAMES))
    editor.pin(1, 0.4)
    assert editor.pose.tolist() == [0.0, 0.4, 0.0, 0.0]
    assert not len(editor.samples(3, 0))
    assert not editor.far


def test_far_from_all_that_is_known_it_says_so(editor) -> None:
    editor.pin(0, 0.1)
    assert not editor.far
    editor.pin(0, 30.0)
    assert editor.far


def test_completions_are_kept_but_not_without_end(editor) -> None:
    rng = np.random.default_rng(0)
    for _ in range(3 * KEPT):
        editor.pin(int(rng.integers(4)), 0.1)
        editor.let_go(int(rng.integers(4)))
    assert editor._completion.cache_info().currsize <= KEPT


def test_sliders_reach_limits_or_all_that_is_known(editor, character) -> None:
    bounds, known = slider_bounds(editor), character[1].poses
    assert (bounds[:, 0] <= np.minimum(known.min(axis=0), 0)).all()
    assert (bounds[:, 1] >= np.maximum(known.max(axis=0), 1)).all()
    limits = np.array([[-1.0, 1], [0, np.inf], [-np.inf, 2], [0, 1]])
    limited = slider_bounds(PoseEditor(Controls(NAMES, limits)))
    assert limited.tolist() == [[-1, 1], [0, 1], [0, 2], [0, 1]]


def test_a_number_beyond_the_limits_is_held_at_them() -> None:
    """The field beside a slider takes any number: 5 for .5 is no pose."""
    limits = np.array([[-1.0, 1], [0, np.inf], [-np.inf, 2], [0, 1]])
    editor = PoseEditor(Controls(NAMES, limits))
    editor.pin_all({0: -7.0, 1: 30.0, 3: 5.0})
    assert editor.pins == {0: -1.0, 1: 30.0, 3: 1.0}
    assert editor.pose.tolist() == [-1.0, 30.0, 0.0, 1.0]


def test_a_mirrored_pose_has_its_sides_exchanged_within_the_limits() -> None:
    limits = np.array([[0.0, 1.0], [-1.0, 1.0], [0.0, 0.5]])
    editor = PoseEditor(Controls(["smile_L", "jaw", "smile_R"], limits))
    editor.begin(np.array([0.8, 0.3, 0.1]))
    editor.pin(1, -0.2)
    editor.mirror()
    assert editor.pose.tolist() == [0.1, -0.2, 0.5]
    assert editor.pins == {1: -0.2}
    assert editor.edit.is_change
    editor.pin(0, 0.4)
    assert editor.one_sided_pin == 0
    editor.pin_counterpart(0)
    assert editor.pose.tolist() == [0.4, -0.2, 0.4]
    assert editor.one_sided_pin is None


def test_what_was_done_is_gone_back_to(editor) -> None:
    editor.pin(0, 0.2)
    once, pose = editor.edit, editor.pose.copy()
    editor.pin(2, 0.1)
    editor.begin_anew(np.full(4, 0.1))
    editor.restore(once)
    np.testing.assert_array_equal(editor.pose, pose)
    assert editor.pins == {0: 0.2}
