import logging

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.rig import Rig
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.mesh.capture import farthest_vertices, simulate_capture

NAMES = ("jawOpen", "browInnerUp_L", "browInnerUp_R", "extra")
STILL = 5


def make_rig(vertices=60):
    """The last vertices hardly move."""
    rng = np.random.default_rng(0)
    shapes = rng.normal(size=(len(NAMES), vertices, 3))
    shapes[:, -STILL:] *= 1e-6
    faces = np.array([[0, 1, 2]])
    return Rig(rng.normal(size=(vertices, 3)), shapes, NAMES, faces, "cm")


def make_performance(frames=50):
    values = np.random.default_rng(1).random((frames, 3))
    source = Source(values, ["BrowInnerUp", "JawOpen", "HeadYaw"])
    return Take(time=np.arange(frames) / 30, source=source, start_timecode="01:00:00:00.000")


def test_without_noise_the_markers_are_the_vertices_of_the_driven_rig():
    rig, performance = make_rig(), make_performance()
    take = simulate_capture(rig, performance, vertices=[3, 7])
    brow, jaw, _ = performance.source.values.T
    driven = rig.deform(np.stack([jaw, brow, brow, 0 * jaw], axis=1))
    np.testing.assert_allclose(take.source.values, driven[:, [3, 7]], atol=1e-12)
    assert take.source.names == ("v3", "v7")
    assert take.units == "cm"
    assert take.start_timecode == performance.start_timecode


def test_the_target_is_the_weights_that_drive_the_rig():
    performance = make_performance()
    take = simulate_capture(make_rig(), performance)
    assert take.controls.names == ("BrowInnerUp", "JawOpen")
    assert take.controls.limits is None
    np.testing.assert_array_equal(take.params, performance.source.values[:, :2])
    assert len(take.labels) == len(take)


def test_names_without_a_match_are_logged(caplog):
    caplog.set_level(logging.INFO)
    simulate_capture(make_rig(), make_performance())
    assert "1 shape of the rig without a weight: extra" in caplog.text
    assert "1 weight without a shape of the rig: HeadYaw" in caplog.text


def test_noise_is_a_share_of_the_largest_deviation():
    rig, performance = make_rig(), make_performance(2000)
    clean = simulate_capture(rig, performance).source.values
    noisy = simulate_capture(rig, performance, noise=0.1).source.values
    assert (noisy - clean).std() == pytest.approx(0.1 * clean.std(axis=0).max(), rel=0.02)


def test_the_share_of_markers_that_is_asked_for_is_hidden():
    take = simulate_capture(make_rig(), make_performance(2000), missing=0.25)
    assert 1 - take.source.valid.mean() == pytest.approx(0.25, abs=0.02)


def test_gaps_and_noise_do_not_change_the_markers_or_each_other():
    rig, performance = make_rig(), make_performance()
    noisy = simulate_capture(rig, performance, markers=10, noise=0.1, seed=3).source
    both = simulate_capture(rig, performance, markers=10, noise=0.1, missing=0.5, seed=3).source
    assert both.names == noisy.names
    np.testing.assert_array_equal(both.values[both.valid], noisy.values[both.valid])


def test_the_seed_decides_everything():
    def simulate(seed):
        options = {"markers": 10, "noise": 0.1, "missing": 0.2, "seed": seed}
        return simulate_capture(make_rig(), make_performance(), **options).source

    np.testing.assert_array_equal(simulate(1).values, simulate(1).values)
    assert simulate(1).names != simulate(2).names


def test_a_frame_whose_weights_were_not_observed_has_neither_markers_nor_pose():
    performance = make_performance()
    values = performance.source.values.copy()
    values[4, 0] = np.nan
    values[5, 2] = np.nan  # an angle: drives nothing
    gap = Take(time=performance.time, source=performance.source.with_matrix(values))
    take = simulate_capture(make_rig(), gap)
    assert np.flatnonzero(~take.source.valid.any(axis=1)).tolist() == [4]
    assert 4 not in take.labels
    assert 5 in take.labels


@settings(deadline=None)
@given(st.integers(1, 55), st.integers(0, 50))
def test_farthest_vertices_differ_move_and_begin_alike(count, seed):
    rig = make_rig()
    chosen = farthest_vertices(rig, count, seed)
    assert len(set(chosen.tolist())) == count
    assert chosen.max() < len(rig.neutral) - STILL
    np.testing.assert_array_equal(chosen, farthest_vertices(rig, 55, seed)[:count])


def test_farthest_vertices_spread_over_a_line():
    points = np.zeros((101, 3))
    points[:, 0] = np.linspace(0, 1, 101)
    rig = Rig(points, np.ones((1, 101, 3)), ("a",), np.empty((0, 3), int))
    chosen = np.sort(farthest_vertices(rig, 9)[1:])
    assert chosen[0] == 0
    assert chosen[-1] == 100
    assert np.diff(np.sort(farthest_vertices(rig, 9))).max() <= 25


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"markers": 56}, "--markers: expected 1 to 55"),
        ({"markers": 0}, "--markers"),
        ({"noise": -0.1}, "--noise"),
        ({"missing": 1.0}, "--missing"),
        ({"vertices": [0, 60]}, "--vertices: expected different vertices from 0 to 59"),
        ({"vertices": [1, 1]}, "--vertices"),
        ({"vertices": [1, 10**20]}, "--vertices"),
    ],
)
def test_options_out_of_range_are_named(options, message):
    with pytest.raises(InputError, match=message):
        simulate_capture(make_rig(), make_performance(), **options)


def test_a_source_that_cannot_drive_the_rig_is_refused():
    markers = Take(time=[0.0], source=Source(np.zeros((1, 1, 3)), ["m"]))
    foreign = Take(time=[0.0], source=Source(np.zeros((1, 1)), ["unknown"]))
    for take, message in [(markers, "expected weights, found markers"), (foreign, "'unknown'")]:
        with pytest.raises(InputError, match=message):
            simulate_capture(make_rig(), take)
