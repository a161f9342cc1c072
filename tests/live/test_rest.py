"""The actor at rest, found in the first seconds."""

import numpy as np

from facert.live.frames import Frame
from facert.live.opening import RestWatch
from facert.preprocess.faults import FaultDetector


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
