"""Whether the head stands where it stood in training."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facert
from facert import Settings
from facert.live.frames import Frame
from facert.live.placement import PlacementWatch, away

TURN = Rotation.from_euler("y", 30.0, degrees=True).as_matrix()
AWAY = np.array([0.0, 300.0, 400.0])


@pytest.fixture(scope="module")
def take(make_take):
    return make_take(frames=90)


@pytest.fixture(scope="module")
def model(take):
    return facert.train(take, Settings(method="ridge"))


def told(model, take, change, caplog, columns=slice(None)):
    """What is said of the first second of changed markers."""
    watch = PlacementWatch(model, take.source.names[columns])
    for time, values in zip(take.time, take.source.values, strict=True):
        watch.see(Frame(time, change(values)[columns], 0.0))
    assert watch.is_over
    watch.tell()
    return caplog.text


def test_a_known_motion_is_measured():
    face = np.random.default_rng(0).normal(size=(9, 3))
    found = away(face @ TURN.T + [3.0, 4.0, 0.0], face - face.mean(axis=0))
    assert found.degrees == pytest.approx(30.0)
    still = away(face, face)
    assert (still.spread, still.distance, still.degrees) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_hidden_markers_are_not_looked_at_and_two_tell_nothing():
    face = np.random.default_rng(0).normal(size=(9, 3))
    moved = face + np.array([3.0, 4.0, 0.0])
    moved[2, 1] = np.nan
    found = away(moved, face)
    assert (found.distance, found.spread) == pytest.approx((5.0, 5.0))
    moved[2:] = np.nan
    assert away(moved, face) is None


def test_a_performance_in_place_is_not_told_about(model, take, caplog):
    assert not told(model, take, lambda values: values, caplog)


def test_another_origin_is_told_with_its_distance_whatever_the_order(model, take, caplog):
    said = told(model, take, lambda values: values + AWAY, caplog, slice(None, None, -1))
    assert "cm and" in said
    assert 490 < float(said.partition("the head is ")[2].split()[0]) < 510
    assert "facert stabilise" in said


def test_a_marker_that_is_never_seen_does_no_harm(model, take, caplog):
    def hidden(values):
        return np.vstack([np.full((1, 3), np.nan), values[1:]])

    assert not told(model, take, hidden, caplog)
