import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert import InputError
from facert.preprocess.neutral import Calibration, at_rest, most_neutral

WEIGHT = st.floats(0.0, 0.49)


def test_markers_are_moved_by_what_differs_at_rest():
    own, learned = np.array([1.0, 2.0, np.nan]), np.array([1.5, np.nan, 3.0])
    X = np.array([[1.0, 2.0, 3.0], [2.0, np.nan, 4.0]])
    moved = Calibration.of(own, learned, "markers").apply(X)
    np.testing.assert_allclose(moved, [[1.5, 2.0, 3.0], [2.5, np.nan, 4.0]])


@given(WEIGHT, WEIGHT)
def test_a_weight_at_rest_and_a_full_one_stay_what_they_are(own, learned):
    X = np.array([[own], [1.0]])
    moved = Calibration.of(np.array([own]), np.array([learned]), "weights").apply(X)
    np.testing.assert_allclose(moved, [[learned], [1.0]], atol=1e-12)


@given(WEIGHT, WEIGHT)
def test_more_of_a_weight_stays_more(own, learned):
    X = np.linspace(-0.2, 1.2, 50)[:, None]
    moved = Calibration.of(np.array([own]), np.array([learned]), "weights").apply(X)
    assert (np.diff(moved[:, 0]) > 0.0).all()


def test_an_angle_that_rests_anywhere_is_moved_and_nothing_more():
    X = np.array([[0.8], [0.9], [1.0]])
    moved = Calibration.of(np.array([0.9]), np.array([0.1]), "weights").apply(X)
    np.testing.assert_allclose(moved, X - 0.8)


@pytest.mark.parametrize("kind", ["markers", "weights"])
def test_the_same_rest_changes_nothing(kind):
    X, rest = np.random.default_rng(0).random((20, 6)), np.full(6, 0.1)
    np.testing.assert_allclose(Calibration.of(rest, rest, kind).apply(X), X)


def test_rest_is_the_mean_of_its_frames_over_what_they_show():
    X = np.array([[1.0, np.nan, np.nan], [3.0, 5.0, np.nan], [9.0, 9.0, 9.0]])
    np.testing.assert_allclose(at_rest(X, np.array([0, 1])), [2.0, 5.0, np.nan])


@pytest.mark.parametrize("frames", [[], [-1], [3]])
def test_frames_that_are_not_there_are_refused(frames):
    with pytest.raises(InputError, match="neutral"):
        at_rest(np.zeros((3, 2)), np.array(frames, dtype=np.int64))


def test_frames_in_which_the_actor_moves_are_warned_about(caplog):
    X = np.sin(np.arange(60.0))[:, None] * np.ones((1, 3))
    at_rest(X, np.arange(1))
    assert not caplog.messages
    at_rest(X, np.arange(10))
    assert "moves" in caplog.text


def test_the_most_neutral_pose_moves_each_control_least_for_its_reach():
    poses = np.array([[0.0, 0.9], [10.0, 0.0], [1.0, 0.1], [5.0, 0.5]])
    assert most_neutral(poses) == 2
