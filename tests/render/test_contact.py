"""Contact sheets of markers and of weights."""

from __future__ import annotations

import numpy as np
import pytest

from facert.data.rig import Rig
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.render.faces import actor_face
from facert.render.sheet import contact_sheet

VERTICES = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
SHAPES = np.stack([VERTICES * 0.5, -VERTICES * 0.1])
RIG = Rig(VERTICES, SHAPES, ("mouthPucker_L", "mouthPucker_R"), np.array([[0, 1, 2], [0, 2, 3]]))
WEIGHTS = np.array([[0.0, 7.0], [1.0, 7.0], [np.nan, 7.0]])


def weights(names=("mouthPucker", "headYaw")) -> Take:
    return Take(np.arange(3) / 30, Source(WEIGHTS, names))


def test_markers_are_drawn_where_they_are(make_take) -> None:
    take = make_take()
    values = take.source.values.copy()
    values[:, 1] = np.nan
    figure = contact_sheet(Take(take.time, Source(values, take.source.names)), [3, 50], ["a", "b"])
    for axes, frame, heading in zip(figure.axes, (3, 50), "ab", strict=True):
        drawn = axes.collections[-1].get_offsets()
        np.testing.assert_allclose(drawn, values[frame][[0, 2, 3, 4], :2])
        assert axes.get_title() == heading


def test_weights_move_the_shapes_of_their_names_and_others_none() -> None:
    face = actor_face(weights(), RIG)
    expected = [VERTICES, VERTICES + SHAPES.sum(axis=0), VERTICES]
    np.testing.assert_allclose(face.motion.fetch(np.arange(3)), expected)


def test_a_sheet_of_faces_has_a_picture_a_frame() -> None:
    figure = contact_sheet(weights(), [0, 1], ["0", "1"], RIG)
    first, second = (axes.images[0].get_array() for axes in figure.axes)
    assert np.abs(first - second).max() > 0.1


@pytest.mark.parametrize(
    ("take", "rig", "message"),
    [
        (weights(), None, "found none"),
        (weights(("a", "b")), RIG, "none for 'a'"),
        (Take(np.arange(2), Source(np.ones((2, 1, 3)), ["m"])), RIG, "a take of markers"),
    ],
)
def test_a_rig_that_does_not_fit_is_refused(take, rig, message) -> None:
    with pytest.raises(InputError, match=message):
        contact_sheet(take, [0], ["0"], rig)
