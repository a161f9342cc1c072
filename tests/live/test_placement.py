"""Whether the head stands where it stood in training."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facert
from facert import Settings
from facert.live.frames import Frame
from facert.live.opening import PlacementWatch, displacement

TURN = Rotation.from_euler("y", 30.0, degrees=True).as_matrix()
AWAY = np.array([0.0, 300.0, 400.0])


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
