"""Shapes that are not in register with the neutral are found, by cause; honest ones never are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from facert.data.rig import Rig
from facert.mesh.registration import misfits, registered

SIDE = 15
X, Y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-0.08, 0.08, SIDE)] * 2))
CORNERS = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
FACES = np.concatenate(
    [
        np.stack([CORNERS[:-1, :-1], CORNERS[:-1, 1:], CORNERS[1:, 1:]], axis=-1).reshape(-1, 3),
        np.stack([CORNERS[:-1, :-1], CORNERS[1:, 1:], CORNERS[1:, :-1]], axis=-1).reshape(-1, 3),
    ]
)
FACE = np.stack([X, Y + 1.6, 0.05 * np.cos(15 * X) * np.cos(12 * Y) + 0.03 * (Y > 0.02)], axis=1)
LOW = np.clip(-Y - 0.02, 0, None)[:, None]
JAW = LOW * [0, -0.6, -0.3]
SMILE = np.exp(-((Y + 0.04) ** 2 + (np.abs(X) - 0.04) ** 2) / 2e-4)[:, None] * [0.01, 0.015, 0]
NODDED = Rotation.from_euler("x", 25, degrees=True).as_matrix()
NECK = np.array([0, 1.55, 0])
NOD = (FACE - NECK) @ NODDED.T + NECK - FACE
NAMES = ("jawOpen", "mouthSmile", "headDown")
RIG = Rig(FACE, np.stack([JAW, SMILE, NOD]), NAMES, FACES)
QUARTER = Rotation.from_euler("x", 90, degrees=True).as_matrix()
RNG = np.random.default_rng(0)


def taken_out(change: Callable[[np.ndarray], np.ndarray], *shapes: int) -> Rig:
    """The rig with some shapes' meshes changed, as if they had been exported otherwise."""
    moved = RIG.shapes.copy()
    for shape in shapes:
        moved[shape] = change(FACE + moved[shape]) - FACE
    return replace(RIG, shapes=moved)


MENDED = {
    "beside": ("beside", lambda y: y + np.array([0.4, 0, 0])),
    "below, as by its feet": ("beside", lambda y: y - [0, 1.6, 0]),
    "in centimetres": ("scale", lambda y: 100 * y),
    "in metres of millimetres": ("scale", lambda y: y / 1000),
    "in inches": ("scale", lambda y: y * 39.37),
    "with z up": ("turned", lambda y: y @ QUARTER.T),
    "seen from behind": ("turned", lambda y: y * [-1, 1, -1]),
    "with y and z swapped": ("mirrored", lambda y: y[:, [0, 2, 1]]),
    "left for right": ("mirrored", lambda y: y * [-1, 1, 1]),
    "with z up in centimetres": ("scale", lambda y: 100 * y @ QUARTER.T + np.array([3, 2, 1])),
}
NOT_MENDED = {
    "any order": ("order", lambda y: y[RNG.permutation(len(y))]),
    "a new order of the last third": (
        "order",
        lambda y: np.concatenate([y[:150], y[150:][RNG.permutation(75)]]),
    ),
    "another first vertex": ("order", lambda y: np.roll(y, 40, axis=0)),
}


@pytest.mark.parametrize("what", MENDED)
def test_shapes_out_of_place_size_or_axes_are_named_and_mended(what: str, caplog) -> None:
    cause, change = MENDED[what]
    rig = taken_out(change, 0)
    assert [(one.shape, one.cause) for one in misfits(rig)] == [(0, cause)]
    assert registered(rig, align=False) is rig
    assert "jawOpen" in caplog.text
    assert "--align-shapes" in caplog.text
    assert "mouthSmile" not in caplog.text
    caplog.clear()
    mended = registered(rig, align=True)
    assert "--align-shapes" not in caplog.text
    assert np.abs(mended.shapes - RIG.shapes).max() < 2e-3  # where the expression is the median
    np.testing.assert_array_equal(mended.shapes[1:], RIG.shapes[1:])


@pytest.mark.parametrize("what", NOT_MENDED)
def test_another_order_is_named_and_stays(what: str, caplog) -> None:
    cause, change = NOT_MENDED[what]
    rig = taken_out(change, 1)
    found = misfits(rig)
    assert [one.shape for one in found] == [1]
    assert found[0].cause == cause
    np.testing.assert_array_equal(registered(rig, align=True).shapes, rig.shapes)
    assert "mouthSmile" in caplog.text


def test_several_shapes_are_one_line(caplog) -> None:
    registered(taken_out(lambda y: 100 * y, 0, 1), align=False)
    assert [record.getMessage() for record in caplog.records] == [
        "jawOpen, mouthSmile are 100 times as large as the neutral: in another unit? "
        "facert convert --align-shapes scales it"
    ]


def test_a_neutral_that_stands_a_little_elsewhere_than_all_shapes_is_found() -> None:
    three = replace(RIG, shapes=RIG.shapes[[0, 1, 1]])
    moved = replace(three, shapes=three.shapes + np.array([0, 0.01, 0.005]))
    assert [one.cause for one in misfits(moved)] == ["beside"] * 3
    np.testing.assert_allclose(registered(moved, align=True).shapes, three.shapes, atol=1e-3)
    two = replace(moved, shapes=moved.shapes - np.array([0, 0.01, 0.005]) * [[[0]], [[0]], [[1]]])
    assert not misfits(two)


@pytest.mark.parametrize("strength", [1.0, 2.0, -1.0])
def test_honest_shapes_are_in_register(strength: float, caplog) -> None:
    rig = replace(RIG, shapes=strength * RIG.shapes)
    assert not misfits(rig)
    assert registered(rig, align=True) is rig
    assert not caplog.records


def test_a_jaw_that_opens_as_far_as_a_small_mesh_is_wide_is_honest() -> None:
    lips = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0.1], [1, 1, 0.1]])
    opened = np.array([[0, -1.0, 0]] * 2 + [[0, 0, 0]] * 2)
    faces = np.array([[0, 1, 3], [0, 3, 2]])
    assert not misfits(Rig(lips, opened[None], ("jawOpen",), faces))


def test_another_order_of_a_few_vertices_is_found_and_lips_that_meet_are_not() -> None:
    face = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0.1], [1, 1, 0.1]])
    faces = np.array([[0, 1, 3], [0, 3, 2]])
    for order in ([3, 2, 1, 0], [1, 0, 2, 3], [2, 0, 3, 1]):
        found = misfits(Rig(face, (face[order] - face)[None], ("smile",), faces))
        assert [one.cause for one in found] == ["order"], order
    closed = np.array([[0.0, 1, 0.1], [0, 1, 0.1], [0, 0, 0], [0, 0, 0]])
    assert not misfits(Rig(face, closed[None], ("mouthClose",), faces))


def test_shapes_that_move_a_whole_small_mesh_a_bit_are_honest() -> None:
    shapes = np.stack([np.full_like(FACE, 0.02), np.full_like(FACE, -0.03)])
    assert not misfits(Rig(FACE, shapes, ("headForward", "teethDown"), FACES))


def test_points_without_extent_or_faces_have_no_register() -> None:
    point = np.zeros((4, 3))
    assert not misfits(Rig(point, np.ones((1, 4, 3)), ("a",), np.empty((0, 3), int)))
    moved = taken_out(lambda y: y + np.array([1, 0, 0]), 0)
    alone = Rig(FACE, moved.shapes, NAMES, np.empty((0, 3), int))
    assert [one.cause for one in misfits(alone)] == ["beside"]
