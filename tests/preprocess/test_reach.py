"""Values far beyond training, in a frame alone."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import facert
from facert.data.normalisation import Normalisation
from facert.data.take import Controls, Source, Take
from facert.mesh.rigid import RigidMotion
from facert.preprocess.faults import Reach


@pytest.fixture(scope="module")
def units(face):
    return Normalisation.of(face.reshape(400, -1), "/source")


def test_markers_of_training_and_of_a_head_elsewhere_are_within_reach(face, head, units):
    reach = Reach.of(units, "markers")
    elsewhere = RigidMotion(head.rotations, head.translations + np.array([0.0, 500.0, 20.0]))
    for markers in (face, head.apply(face), elsewhere.apply(face), 1000.0 * face):
        assert reach.beyond(units.apply(markers.reshape(400, -1))) is None


def test_a_marker_far_away_is_beyond_it(face, head, units):
    reach, markers = Reach.of(units, "markers"), head.apply(face)
    markers[10:20, 7] += [0.0, 40.0, 0.0]
    markers[15:30, 3, 2] = -9999.0
    far = reach.beyond(units.apply(markers.reshape(400, -1)))
    assert far is not None
    expected = np.zeros((400, 20), dtype=bool)
    expected[10:20, 7] = expected[15:30, 3] = True
    np.testing.assert_array_equal(far[:, ::3], expected)


def test_of_very_many_markers_some_tell_the_size_of_the_face():
    places = np.random.default_rng(0).normal(size=(20_000, 3))
    tracemalloc.start()
    reach = Reach.of(Normalisation(places.ravel(), 1.0), "markers")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50e6
    few = Reach.of(Normalisation(places[:600].ravel(), 1.0), "markers")
    assert reach.limit == pytest.approx(few.limit, rel=0.05)


@pytest.mark.parametrize("scale", [1.0, 100.0])
def test_weights_may_be_full_but_not_absurd(scale):
    rng = np.random.default_rng(0)
    quiet = scale * 0.05 * rng.random((50, 6))
    units = Normalisation.of(quiet, "/source")
    reach = Reach.of(units, "weights")
    frame = scale * np.array([[1.0, 1.0, 0.0, -1.0, 1.5, 0.3]])
    assert reach.beyond(units.apply(frame)) is None
    frame[0, 2] = scale * 1e6
    far = reach.beyond(units.apply(frame))
    assert far is not None
    assert far.tolist() == [[False, False, True, False, False, False]]


@pytest.fixture(scope="module")
def marker_take(face):
    params = np.full((400, 2), np.nan)
    params[::20] = face[::20, 15, :2]
    names = [f"m{i}" for i in range(20)]
    return Take(
        np.arange(400) / 30.0, Source(face, names), controls=Controls(("a", "b")), params=params
    )


@pytest.mark.parametrize("mode", ["offline", "online"])
def test_a_marker_that_is_lost_for_most_of_a_shot_is_hidden(marker_take, face, mode, caplog):
    model = facert.train(marker_take, facert.Settings(method="ridge"))
    markers = face[:60].copy()
    markers[5:, 14] += [0.0, 60.0, 0.0]
    hidden = markers.copy()
    hidden[5:, 14] = np.nan
    takes = [
        Take(np.arange(60) / 30.0, Source(values, marker_take.source.names))
        for values in (markers, hidden)
    ]
    found, expected = (model.retarget(take, mode=mode).params for take in takes)
    tail = slice(5, None)
    # Offline the five good frames of the marker are in doubt as well.
    np.testing.assert_allclose(found[tail], expected[tail], atol=0.3)
    assert "m14" in caplog.text
