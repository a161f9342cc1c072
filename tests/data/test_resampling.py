"""Another frame rate: values by time, never by row."""

from __future__ import annotations

import logging
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.rate import nominal_rate
from facert.data.resampling import counted_at, evenly_spaced, resampled
from facert.data.take import Controls, Source, Take
from facert.errors import InputError

NAMES = ("a", "b")


def line(time: np.ndarray) -> np.ndarray:
    """Weights that go linearly with time, (T, 2)."""
    return np.stack([2 * time + 1, -time], axis=1)


def make(time: np.ndarray, fps: float, **others) -> Take:
    time = np.asarray(time, dtype=float)
    return Take(time=time, source=Source(line(time), NAMES), fps=fps, **others)


TAKE = make(np.arange(61) / 60, 60.0)


@settings(deadline=None, max_examples=50)
@given(st.floats(5, 240))
def test_a_linear_motion_stays_on_its_line(fps: float) -> None:
    found = resampled(TAKE, fps)
    np.testing.assert_allclose(found.source.values, line(found.time), atol=3e-6)
    # A microsecond off is the rate that it has.
    np.testing.assert_allclose(np.diff(found.time), 1 / fps, atol=1e-6)
    assert found.time[0] == 0
    assert 1 - 1 / fps < found.time[-1] <= 1
    assert found.fps == fps


def test_the_rate_that_it_has_already_changes_nothing() -> None:
    np.testing.assert_array_equal(resampled(TAKE, 60.0).source.values, TAKE.source.values)


def test_up_and_down_again_gives_the_same_frames() -> None:
    rough = replace(TAKE, source=Source(np.random.default_rng(0).normal(size=(61, 2)), NAMES))
    again = resampled(resampled(rough, 120.0), 60.0)
    np.testing.assert_allclose(again.source.values, rough.source.values, atol=1e-12)


def test_uneven_frames_become_even_ones() -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(0.8, 1.2, 90)) / 30
    found = resampled(make(time, 30.0), 30.0)
    np.testing.assert_allclose(np.diff(found.time), 1 / 30)
    np.testing.assert_allclose(found.source.values, line(found.time), atol=1e-12)


def test_a_pause_of_the_recording_has_frames_in_which_nothing_is_observed() -> None:
    time = np.delete(np.arange(60) / 30, range(20, 40))
    found = resampled(make(time, 30.0), 120.0)
    inside = (found.time > 19 / 30 + 1e-9) & (found.time < 40 / 30 - 1e-9)
    np.testing.assert_array_equal(found.source.valid.any(axis=1), ~inside)
    np.testing.assert_allclose(found.time, np.arange(4 * 59 + 1) / 120)
    np.testing.assert_allclose(found.source.values[~inside], line(found.time)[~inside])


def test_missing_frames_come_back_unobserved_at_the_same_rate() -> None:
    time = np.round(np.delete(np.arange(60) / 30, [7, 20, 21]), 3)
    found = resampled(make(time, 30.0, start_timecode="10:00:00:00"), 30.0)
    np.testing.assert_allclose(found.time, np.arange(60) / 30)
    assert np.flatnonzero(~found.source.valid.any(axis=1)).tolist() == [7, 20, 21]
    kept = np.delete(np.arange(60), [7, 20, 21])
    np.testing.assert_array_equal(found.source.values[kept], line(time))  # to the last bit


def test_all_that_a_result_has_goes_with_its_frames() -> None:
    take = posed(list(range(61)))
    take = replace(take, std=take.params / 10)
    kept = np.delete(np.arange(61), range(30, 36))
    source = Source(take.source.values[kept], NAMES)
    fields = {name: getattr(take, name)[kept] for name in ("time", "params", "std")}
    holed = replace(take, source=source, **fields)
    for fps in (60.0, 30.0, 24.0):
        found = resampled(holed, fps)
        gone = (found.time > 29 / 60 + 1e-9) & (found.time < 36 / 60 - 1e-9)
        assert len(found) == round(fps) + 1
        np.testing.assert_allclose(found.params[~gone, 0], 60 * found.time[~gone], atol=0.51)
        assert np.isnan(found.std[gone]).mean() > 0.6
        assert len(found.labels) < len(found)


def test_a_gap_of_a_marker_stays_one() -> None:
    values = np.arange(21.0)[:, None, None] + np.zeros((21, 2, 3))
    values[5:8, 1] = np.nan
    take = Take(np.arange(21) / 10, Source(values, NAMES), fps=10.0)
    found = resampled(take, 20.0)
    hidden = (found.time > 0.4 + 1e-9) & (found.time < 0.8 - 1e-9)
    np.testing.assert_array_equal(found.source.valid[:, 1], ~hidden)
    assert found.source.valid[:, 0].all()
    np.testing.assert_allclose(found.source.values[~hidden, 1, 0], found.time[~hidden] * 10)


def posed(frames: list[int], fps: float = 60.0) -> Take:
    params = np.full((61, 1), np.nan)
    params[frames, 0] = frames
    return make(np.arange(61) / fps, fps, controls=Controls(("jaw",)), params=params)


def test_labels_on_frames_that_stay_keep_their_place(caplog: pytest.LogCaptureFixture) -> None:
    found = resampled(posed([0, 10, 60]), 30.0)
    assert found.labels.tolist() == [0, 5, 30]
    assert found.params[5, 0] == 10
    assert not caplog.records


def test_no_label_is_lost_between_frames(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING, "facert")
    found = resampled(posed([11, 40]), 30.0)
    assert found.params[found.labels, 0].tolist() == [11, 40]
    assert abs(found.time[found.labels[0]] - 11 / 60) <= 1 / 60 + 1e-9
    assert "1 pose moved by up to 17 ms" in caplog.text


def test_two_labels_for_one_frame_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING, "facert")
    found = resampled(posed([7, 13, 40]), 5.0)
    assert found.params[found.labels, 0].tolist() == [13, 40]
    assert "left out 1 pose without a free frame" in caplog.text


def test_a_label_goes_over_no_pause(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING, "facert")
    time = np.r_[np.arange(30), 50.4, np.arange(80, 100)] / 30
    params = np.full((51, 1), np.nan)
    params[[3, 30]] = 1
    found = resampled(make(time, 30.0, controls=Controls(("jaw",)), params=params), 30.0)
    assert found.labels.tolist() == [3]
    assert "left out 1 pose without a free frame" in caplog.text


def test_a_long_take_has_one_frame_more_than_steps() -> None:
    time = np.arange(20_000) / 100
    assert len(resampled(make(time, 100.0), 1000.0)) == 199_991


def test_poses_of_all_frames_go_linearly() -> None:
    found = resampled(posed(list(range(61))), 24.0)
    np.testing.assert_allclose(found.params[:, 0], found.time * 60)


def test_a_lower_rate_loses_no_pose_of_animation(caplog: pytest.LogCaptureFixture) -> None:
    """Every other frame of a result is shown as it is, and the others stand amid poses."""
    found = resampled(posed(list(range(61))), 15.0)
    assert len(found.labels) == len(found) == 16
    assert not caplog.records


def test_deviations_go_with_what_they_are_of() -> None:
    take = posed(list(range(61)))
    source = replace(take.source, std=line(take.time) ** 2)
    found = resampled(replace(take, std=take.params / 10, source=source), 30.0)
    np.testing.assert_allclose(found.std, found.params / 10)
    np.testing.assert_allclose(found.source.std, line(found.time) ** 2)


@pytest.mark.parametrize(
    ("start", "new"),
    [
        ("01:00:00:30", "01:00:00:15"),
        ("10:20:30:59.500", "10:20:30:59.500"),
        ("", ""),
        ("noon", "noon"),
    ],
)
def test_the_start_timecode_counts_frames_of_the_new_rate(start: str, new: str) -> None:
    assert resampled(replace(TAKE, start_timecode=start), 30.0).start_timecode == new


def test_a_single_frame_stays() -> None:
    assert len(resampled(make([3.0], 30.0), 60.0)) == 1


@pytest.mark.parametrize("fps", [0.0, -1.0, np.nan, np.inf, 1e9])
def test_a_rate_that_makes_no_sense_is_refused(fps: float) -> None:
    with pytest.raises(InputError, match="--fps"):
        resampled(TAKE, fps)


def phone(seconds: float) -> np.ndarray:
    """Times of a camera that gives 27 to 31 frames a second, as it is warm or dark."""
    steps = 1 / (29 + 2 * np.sin(np.arange(int(31 * seconds)) / 50))
    return np.round(np.cumsum(steps), 3)


def test_uneven_frames_are_played_at_the_moments_when_they_were(caplog) -> None:
    caplog.set_level(logging.INFO, "facert")
    time = phone(60)
    found = evenly_spaced(make(time, nominal_rate(time)))
    np.testing.assert_allclose(found.time - found.time[0], np.arange(len(found)) / found.fps)
    np.testing.assert_allclose(found.source.values, line(found.time), atol=1e-9)
    assert "frames lie unevenly: resampled" in caplog.text


@pytest.mark.parametrize("digits", [2, 3, 6])
@pytest.mark.parametrize("fps", [24.0, 25.0, 30000 / 1001, 30.0, 60.0])
def test_even_frames_stay_as_they_are_however_rounded(fps: float, digits: int) -> None:
    take = make(np.round(np.arange(18_000) / fps + 0.2, digits), fps)
    found = evenly_spaced(take)
    np.testing.assert_array_equal(found.time, take.time)
    np.testing.assert_array_equal(found.source.values, take.source.values)


def test_frames_are_counted_anew_with_their_gaps(caplog) -> None:
    caplog.set_level(logging.INFO, "facert")
    time = np.delete(np.arange(60.0), [20, 21])
    found = counted_at(make(time, 1.0), 25.0)
    np.testing.assert_allclose(found.time, time / 25)
    assert found.fps == 25.0
    assert "show 1 frames/s: counted at 25" in caplog.text


def test_a_rate_that_uneven_frames_contradict_is_refused() -> None:
    time = phone(10)
    with pytest.raises(InputError, match="--in-fps: expected about 2"):
        counted_at(make(time, 30.0), 60.0)
    shown = nominal_rate(time)
    np.testing.assert_array_equal(counted_at(make(time, 30.0), shown * 1.005).time, time)


@pytest.mark.parametrize(("stated", "meant"), [(29.97, 30000 / 1001), (23.98, 24000 / 1001)])
def test_a_rate_that_is_given_counts_exactly(stated: float, meant: float) -> None:
    found = counted_at(make(np.arange(18_000) / round(meant), float(round(meant))), stated)
    assert found.fps == meant
    np.testing.assert_allclose(found.time, np.arange(18_000) / meant)


def test_a_pause_of_hours_is_not_played() -> None:
    time = np.append(np.arange(30), 30 + 3600 * 30 + np.arange(30)) / 30
    with pytest.raises(InputError, match="s without frames after frame 29"):
        evenly_spaced(make(time, 30.0))
    assert len(evenly_spaced(make(np.append(time[:30], time[30:] - 3540), 30.0))) == 60 * 31


def test_what_would_not_fit_is_refused_before_a_frame_is_made() -> None:
    """A file of a few rows and a rate that counts as few frames can be asked for gibibytes."""
    values = np.zeros((3, 4_000))
    wide = Take(np.arange(3) / 30, Source(values, [f"w{i}" for i in range(4_000)]), fps=30.0)
    tracemalloc.start()
    with pytest.raises(InputError, match=r"--fps \(66667 frames\): expected at most .* of memory"):
        resampled(wide, 1e6)
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()
