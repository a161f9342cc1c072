"""When a session gets ready for the next frame."""

import math

import pytest

from facert.live.rhythm import EARLY, EVERY, SHARE, SILENCE, Rhythm


@pytest.fixture
def steady():
    """Sixty frames a second, the last of which has just come, at 5 s."""
    rhythm = Rhythm()
    for number in range(300, -1, -1):
        rhythm.heard(5.0 - number / 60)
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
    steady.heard(60.0)
    assert steady.until_ready(60.0, cost=0.0) == pytest.approx(EARLY / 60, rel=1e-6)
