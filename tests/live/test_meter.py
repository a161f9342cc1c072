import numpy as np
import pytest

from facert.live.meter import KEPT, Meter


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
