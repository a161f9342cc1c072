"""The nominal rate: whole, or 29.97 and the like where the recording tells."""

from __future__ import annotations

import numpy as np
import pytest

from facert.data.rate import BROKEN, frames_shown, nominal_rate, standard_rate

WHOLE = (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 90, 100, 120)


@pytest.mark.parametrize("rate", [*WHOLE, *BROKEN])
@pytest.mark.parametrize("digits", [3, 4, 6, 15])
@pytest.mark.parametrize("rows", [600, 18_000])
def test_a_recording_shows_its_rate_however_its_times_are_rounded(rate, digits, rows) -> None:
    time = np.round(np.arange(rows) / rate + 12.3, digits)
    assert nominal_rate(time) == rate
    kept = np.random.default_rng(0).random(rows) > 0.05  # rows without a face
    assert nominal_rate(time[kept]) == rate


@pytest.mark.parametrize("rate", [24, 25, 30, 50, 1000 * 30 / 1001, 1000 * 60 / 1001])
def test_hundredths_of_a_second_are_enough_for_a_minute(rate) -> None:
    assert nominal_rate(np.round(np.arange(3600) / rate, 2)) == rate


@pytest.mark.parametrize("rate", BROKEN)
def test_what_is_too_short_to_tell_is_whole(rate) -> None:
    time = np.round(np.arange(8) / rate, 3)
    assert nominal_rate(time) == round(rate)


@pytest.mark.parametrize("rate", [30.0, 1000 * 30 / 1001, 60.0, 1000 * 60 / 1001])
@pytest.mark.parametrize("jitter", [0.02, 0.08])
def test_jitter_hides_no_rate_in_ten_minutes(rate, jitter) -> None:
    random = np.random.default_rng(1)
    time = np.arange(int(600 * rate)) / rate + random.normal(0, jitter / rate, int(600 * rate))
    assert nominal_rate(np.sort(time)) == rate


def test_an_odd_rate_stays() -> None:
    assert nominal_rate(np.arange(50) / 29.5) == pytest.approx(29.5)
    assert nominal_rate(np.array([0.0, 0.5])) == 2.0
    assert nominal_rate(np.array([0.0])) == 30.0


@pytest.mark.parametrize(
    ("stated", "rate"),
    [(29.97, 30e3 / 1001), (59.94, 60e3 / 1001), (119.88, 120e3 / 1001), (23.976, 24e3 / 1001),
     (23.98, 24e3 / 1001), (47.952, 48e3 / 1001), (29.9700298, 30e3 / 1001), (30, 30.0),
     (29.9, 29.9), (24.0, 24.0)],
)  # fmt: skip
def test_stated_rates_stand_for_those_of_television(stated, rate) -> None:
    assert standard_rate(stated) == rate


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("time", [[0, 1e-11, 1e8], [0, 1e-11, 3e-11, 1e9, 2e9], [0, 1e-9, 1e12]])
def test_absurd_steps_overflow_nothing(time):
    assert nominal_rate(np.array(time)) > 0
    frames_shown(np.array(time))


@pytest.mark.parametrize("fps", [239.75, 23.97, 29.9, 29.98, 59.9, 119.87])
def test_a_rate_near_one_of_television_is_used_as_given(fps):
    assert standard_rate(fps) == fps


@pytest.mark.parametrize("end", [1e22, 1e300])
@pytest.mark.filterwarnings("error")
def test_a_gap_of_ages_hides_no_rate(end) -> None:
    assert nominal_rate(np.append(np.arange(5) / 60, end)) == 60.0


@pytest.mark.parametrize(
    "time", [[0, 0.01, np.inf], [-np.inf, 0, 1], [0, 5e-324, 1], [0, 1e-300, 1]]
)
@pytest.mark.filterwarnings("error")
def test_times_that_cannot_be_have_some_rate_and_no_warning(time) -> None:
    assert nominal_rate(np.array(time, dtype=np.float64)) > 0
