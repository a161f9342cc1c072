"""The first seconds of a session: the actor at rest, and whether the head stands as in training."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facert
from facert import Settings
from facert.live.frames import Frame
from facert.live.opening import PlacementWatch, RestWatch, displacement
from facert.preprocess.faults import FaultDetector

TURN = Rotation.from_euler("y", 30.0, degrees=True).as_matrix()
AWAY = np.array([0.0, 300.0, 400.0])


def watched(values, seconds=1.0, fps=10.0):
    watch = RestWatch(seconds)
    for number, row in enumerate(values):
        watch.see(Frame(number / fps, row, 0.0))
    return watch


def test_it_is_the_median_of_the_first_seconds_blinks_and_all(caplog):
    frames = np.full((30, 2, 3), 1.0) + 0.01 * np.random.default_rng(0).normal(size=(30, 2, 3))
    frames[3] += 0.5  # a blink
    frames[10:] += 5.0  # the performance
    watch = watched(frames)
    assert watch.is_over
    rest = watch.rest(scale=1.0)
    np.testing.assert_allclose(rest, np.median(frames[:10], axis=0))
    np.testing.assert_allclose(rest, 1.0, atol=0.03)
    assert not caplog.messages


def test_what_was_hidden_now_and_then_is_known_and_what_always_was_is_not():
    frames = np.arange(40.0).reshape(10, 4)
    frames[:4, 1] = frames[:, 2] = np.nan
    rest = watched([*frames, frames[0]]).rest(scale=100.0)
    np.testing.assert_allclose(rest, [18.0, 27.0, np.nan, 21.0])


def test_it_waits_for_a_frame_however_late_that_comes():
    watch = RestWatch(1.0)
    watch.see(Frame(7.0, np.ones(3), 0.0))
    assert not watch.is_over
    watch.see(Frame(8.0, np.zeros(3), 0.0))
    assert watch.is_over
    np.testing.assert_array_equal(watch.rest(scale=1.0), np.ones(3))


def test_an_actor_who_moves_does_not_rest(caplog):
    watched(np.sin(np.arange(20.0))[:, None]).rest(scale=1.0)
    assert "the actor moves" in caplog.text


def test_a_lost_marker_written_as_zero_does_not_rest_there():
    frames = 1.0 + 0.001 * np.random.default_rng(0).normal(size=(10, 3, 3))
    frames[:, 1] = 0.0
    watch = RestWatch(1.0, FaultDetector(3))
    for number, row in enumerate([*frames, frames[0]]):
        watch.see(Frame(number / 10, row, 0.0))
    rest = watch.rest(scale=1.0)
    assert np.isnan(rest[1]).all()
    np.testing.assert_allclose(rest[[0, 2]], 1.0, atol=0.01)


def test_numbers_that_would_overflow_are_no_place_to_rest():
    frames = np.ones((11, 2, 3))
    frames[:, 0, 0] = 1.5e308
    rest = watched(frames).rest(scale=1.0)
    assert np.isnan(rest[0, 0])
    np.testing.assert_array_equal(rest[1], 1.0)


@pytest.fixture(scope="module")
def take(make_take):
    return make_take(frames=90)


@pytest.fixture(scope="module")
def model(take):
    return facert.train(take, Settings(method="ridge"))


def warning(model, take, change, caplog, columns=slice(None)):
    """What is warned about after the first second of changed markers."""
    watch = PlacementWatch(model, take.source.names[columns])
    for time, values in zip(take.time, take.source.values, strict=True):
        watch.see(Frame(time, change(values)[columns], 0.0))
    assert watch.is_over
    watch.warn()
    return caplog.text


def test_a_known_motion_is_measured():
    face = np.random.default_rng(0).normal(size=(9, 3))
    found = displacement(face @ TURN.T + [3.0, 4.0, 0.0], face - face.mean(axis=0))
    assert found.degrees == pytest.approx(30.0)
    still = displacement(face, face)
    assert (still.spread, still.distance, still.degrees) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_hidden_markers_are_not_looked_at_and_two_are_too_few():
    face = np.random.default_rng(0).normal(size=(9, 3))
    moved = face + np.array([3.0, 4.0, 0.0])
    moved[2, 1] = np.nan
    found = displacement(moved, face)
    assert (found.distance, found.spread) == pytest.approx((5.0, 5.0))
    moved[2:] = np.nan
    assert displacement(moved, face) is None


def test_a_performance_in_place_is_not_warned_about(model, take, caplog):
    assert not warning(model, take, lambda values: values, caplog)


def test_another_origin_is_reported_with_its_distance_whatever_the_order(model, take, caplog):
    text = warning(model, take, lambda values: values + AWAY, caplog, slice(None, None, -1))
    assert "cm and" in text
    assert 490 < float(text.partition("the head is ")[2].split()[0]) < 510
    assert "facert stabilise" in text


def test_a_marker_that_is_never_seen_does_no_harm(model, take, caplog):
    def hidden(values):
        return np.vstack([np.full((1, 3), np.nan), values[1:]])

    assert not warning(model, take, hidden, caplog)
