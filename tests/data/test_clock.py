"""Clocks that are set back go on by their own steps; rows that are late or twice are dropped."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from facert.data.clock import rising

STEP = 1 / 30


def noise(rows: int) -> np.ndarray:
    return np.random.default_rng(0).normal(size=(rows, 3))


@pytest.mark.parametrize("seconds", [3600.0, 2.0, 0.05, 86400.0, 1.013])
@pytest.mark.parametrize("place", [3, 90, 170])
def test_a_clock_that_is_set_back_is_put_together(seconds, place, caplog) -> None:
    true = 9000 + np.arange(180) * STEP
    clock = true - seconds * (np.arange(180) >= place)
    kept, time = rising(clock, noise(180))
    assert kept.tolist() == list(range(180))
    np.testing.assert_allclose(time, true, atol=1e-9)
    assert f"back by {seconds:.4g} s at row {place + 1}: put together" in caplog.text


def test_twice_in_a_recording_with_jitter_and_gaps() -> None:
    random = np.random.default_rng(1)
    true = np.cumsum(random.uniform(0.8, 1.2, 400)) * STEP
    true = np.delete(true, range(60, 90))
    rows = np.arange(len(true))
    clock = true - 2.0 * (rows >= 120) - 3600 * (rows >= 300)
    kept, time = rising(clock, noise(len(true)))
    assert len(kept) == len(true)
    np.testing.assert_allclose(time, true, atol=0.5 * STEP)


def test_a_whole_hour_of_frames_goes_on(caplog) -> None:
    true = np.arange(4 * 3600) / 2  # two hours, set back after one: every moment is there twice
    kept, time = rising(true - 3600 * (true >= 3600), noise(len(true)))
    assert len(kept) == len(true)
    np.testing.assert_allclose(time, true)


@pytest.mark.parametrize("hours", [1, 2])
def test_rows_that_are_missing_where_an_hour_is_set_back_stay_so(hours, caplog) -> None:
    true = np.delete(9000 + np.arange(180) * STEP, range(80, 100))
    clock = true - 3600 * hours * (np.arange(160) >= 80)
    _, time = rising(clock, noise(160))
    np.testing.assert_allclose(time, true, atol=1e-9)
    assert f"back by {3600 * hours} s at row 81" in caplog.text


@pytest.mark.parametrize(
    "order",
    [
        [*range(20), 21, 20, *range(22, 40)],  # one row late
        [*range(20), 19, *range(20, 40)],  # one twice
        [*range(20), *range(12, 20), *range(20, 40)],  # a block twice
        [*range(20), 25, 26, 27, 20, 21, 22, 23, 24, *range(28, 40)],  # a block late
        [*range(40), *range(30, 40)],  # a block twice at the end
        [*range(20), *range(24, 40), 20, 21, 22, 23],  # a block late at the end
        [*range(39), 37],
    ],
)
def test_rows_that_are_late_or_twice_are_dropped(order, caplog) -> None:
    values = noise(40)[order]
    kept, time = rising(np.array(order) * STEP, values)
    assert (np.diff(time) > 0).all()
    np.testing.assert_allclose(time, np.array(order)[kept] * STEP)  # no time is moved
    dropped = len(order) - len(kept)
    assert f"dropped {dropped} row" in caplog.text
    assert "put together" not in caplog.text


@pytest.mark.parametrize("sigma", [0.3, 0.4, 0.6, 1.0])
def test_jitter_never_adds_up(sigma) -> None:
    """Rows whose clock steps back by a jitter are dropped: nothing after them moves."""
    clock = np.arange(2000) * STEP + np.random.default_rng(2).normal(0, sigma * STEP, 2000)
    kept, time = rising(clock, noise(2000))
    np.testing.assert_allclose(time, clock[kept], atol=3 * STEP)


def test_a_clock_that_rises_is_as_it_is(caplog) -> None:
    caplog.set_level(logging.DEBUG, "facert")
    clock = np.array([0.0, 0.1, 5.0, 5.1, 900.0])
    kept, time = rising(clock, noise(5))
    np.testing.assert_array_equal(time, clock)
    assert len(kept) == 5
    assert not caplog.records


def test_seconds_that_are_none_are_left_to_others() -> None:
    clock = np.array([0.0, np.nan, 0.05, 0.0])
    assert rising(clock, noise(4))[1] is clock


def test_an_hour_of_drop_frame_is_a_little_less(caplog) -> None:
    step = 1001 / 30000
    true = 9000 + np.arange(180) * step
    clock = true - 107892 * step * (np.arange(180) >= 90)
    np.testing.assert_allclose(rising(clock, noise(180))[1], true, atol=1e-6)
