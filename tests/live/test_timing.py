"""When the next frame is due, and how fast a session runs."""

import math

import numpy as np
import pytest

from facert.live.timing import EARLY, EVERY, KEPT, SHARE, SILENCE, Meter, Rhythm


@pytest.fixture
def steady():
    """Sixty frames a second, the last of which has just come, at 5 s."""
    rhythm = Rhythm()
    for number in range(300, -1, -1):
        rhythm.add(5.0 - number / 60)
    return rhythm


def test_it_is_time_shortly_before_the_next_frame(steady):
    assert steady.until_ready(5.0, cost=0.0) == pytest.approx(EARLY / 60, rel=1e-6)
    assert steady.until_ready(5.005, cost=0.0) == pytest.approx(EARLY / 60 - 0.005, rel=1e-6)


def test_and_again_while_the_frame_does_not_come(steady):
    assert steady.until_ready(5.0 + 1 / 60, cost=0.0) == EVERY
    assert steady.until_ready(5.0 + SILENCE / 2, cost=0.0) == EVERY


def test_what_takes_long_is_done_less_often(steady):
    assert steady.until_ready(5.0 + 1 / 60, cost=0.002) == 0.002 / SHARE


def test_nothing_is_expected_before_the_first_frame_and_in_a_silence(steady):
    assert Rhythm().until_ready(0.0, cost=0.0) == math.inf
    assert steady.until_ready(5.0 + SILENCE, cost=0.0) == math.inf


def test_a_silence_is_no_rhythm(steady):
    steady.add(60.0)
    assert steady.until_ready(60.0, cost=0.0) == pytest.approx(EARLY / 60, rel=1e-6)


def test_figures_are_those_of_the_latest_frames_in_memory_that_does_not_grow():
    rng = np.random.default_rng(0)
    spent = rng.uniform(0.0, 0.01, KEPT + 5000)
    meter = Meter()
    for number, seconds in enumerate(spent):
        meter.add(number / 120, number / 120, number / 120 + seconds)
    pace, latest = meter.pace(100), 1e3 * spent[-100:]
    assert pace.rate == pytest.approx(120)
    assert pace.median == pytest.approx(np.median(latest))
    assert pace.p99 == pytest.approx(np.percentile(latest, 99))
    assert meter.pace().worst == pytest.approx(1e3 * spent[-KEPT:].max())


def test_the_cost_of_a_frame_follows_slowly():
    meter = Meter()
    for _ in range(200):
        meter.add(0.0, 0.0, 0.001)
    assert meter.cost == pytest.approx(0.001, rel=1e-3)
    meter.add(0.0, 0.0, 0.1)
    assert meter.cost < 0.01
