"""The stand-in face: every shape of ARKit does what its name says, and lids close over the ball."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from facert.data.names import ARKIT_ANGLES, ARKIT_SHAPES
from facert.data.take import Source, Take
from facert.demo import arkit_face, build
from facert.demo.head import make_head
from facert.demo.skin import LID_EDGE, LIP_EDGE
from facert.demo.stand_in import is_tracked, stand_in_face, stand_in_weights

RIG = arkit_face()
HEAD = make_head(build.ARKIT, inner=True)
LEFT = [name for name in ARKIT_SHAPES if name.endswith("Left")]
WAYS = {
    "jawOpen": (HEAD.build.chin, (0, -1, 0)),
    "jawForward": (HEAD.build.chin, (0, 0, 1)),
    "jawLeft": (HEAD.build.chin, (1, 0, 0)),
    "mouthLeft": (HEAD.build.mouth.centre, (1, 0, 0)),
    "mouthSmileLeft": ((2.4, -5.0), (0, 1, 0)),
    "mouthFrownLeft": ((2.4, -5.0), (0, -1, 0)),
    "mouthStretchLeft": ((2.4, -5.0), (1, 0, 0)),
    "mouthDimpleLeft": ((2.4, -5.0), (0, 0, -1)),
    "mouthPucker": ((2.3, -5.1), (-1, 0, 0.5)),
    "mouthFunnel": ((0.0, -5.8), (0, -1, 1)),
    "mouthUpperUpLeft": ((0.9, -4.9), (0, 1, 0)),
    "mouthLowerDownLeft": ((0.9, -5.8), (0, -1, 0)),
    "mouthShrugUpper": ((0.0, -4.9), (0, 1, 1)),
    "mouthShrugLower": ((0.0, -5.9), (0, 1, 1)),
    "mouthRollLower": ((0.0, -5.8), (0, 1, -1)),
    "mouthRollUpper": ((0.0, -4.9), (0, -1, -1)),
    "cheekPuff": ((3.4, -4.3), (1, 0, 1)),
    "cheekSquintLeft": (HEAD.build.cheek, (0, 1, 0)),
    "noseSneerLeft": (HEAD.build.nose, (0, 1, 0)),
    "browInnerUp": (HEAD.build.brow.inner, (0, 1, 0)),
    "browOuterUpLeft": (HEAD.build.brow.outer, (0, 1, 0)),
    "browDownLeft": (HEAD.build.brow.inner, (0, -1, 0)),
}


def posed(**weights: float) -> np.ndarray:
    return RIG.deform(np.array([weights.get(name, 0.0) for name in RIG.names])[None])[0]


def tracked(names: tuple[str, ...], values: np.ndarray) -> Take:
    return Take(np.arange(len(values)) / 30, Source(values, names))


def test_it_has_all_shapes_and_each_moves_something() -> None:
    assert RIG.names == ARKIT_SHAPES
    assert len(set(RIG.names)) == 52
    assert (np.abs(RIG.shapes).max(axis=(1, 2)) > 0.2).all()
    for first, second in itertools.combinations(RIG.shapes, 2):
        assert np.abs(first - second).max() > 0.05


@pytest.mark.parametrize("name", LEFT)
def test_left_and_right_mirror_each_other(name: str) -> None:
    left, right = (RIG.shapes[RIG.names.index(name[:-4] + side)] for side in ("Left", "Right"))
    np.testing.assert_array_equal(left, right[HEAD.mirror] * [-1, 1, 1])


@pytest.mark.parametrize("name", WAYS)
def test_a_shape_moves_its_place_its_way(name: str) -> None:
    place, way = WAYS[name]
    near = np.linalg.norm(RIG.neutral[:, :2] - place, axis=1) < 0.6
    depth = RIG.neutral[:, 2]
    shown = near & (depth > depth[near].max() - 0.4)  # not what lies inside
    moved = RIG.shapes[RIG.names.index(name), shown].mean(axis=0)
    assert (moved * np.sign(way) >= 0.05 * np.abs(way)).all()


@pytest.mark.parametrize(("name", "axis"), [("In", -1), ("Out", 1), ("Up", 1), ("Down", -1)])
def test_eyeballs_turn_in_their_sockets(name: str, axis: int) -> None:
    ball, eye = HEAD.pieces["eyeball"], HEAD.build.eye
    looking = posed(**{f"eyeLook{name}Left": 1.0})
    pupil = looking[ball[0]] - RIG.neutral[ball[0]]
    assert axis * pupil[0 if name in ("In", "Out") else 1] > 0.5
    radius = np.linalg.norm((looking[ball] - eye.centre) / eye.ball, axis=1)
    np.testing.assert_allclose(radius, 1, atol=1e-3)
    np.testing.assert_array_equal(looking[HEAD.mirror[ball]], RIG.neutral[HEAD.mirror[ball]])


@pytest.mark.parametrize(
    "weights",
    [{"eyeBlink": 1.0}, {"eyeBlink": 0.9, "eyeSquint": 1.0, "eyeLookDown": 1.0},
     {"eyeSquint": 1.0}, {"eyeLookDown": 1.0}, {"eyeWide": 1.0}, {"eyeLookUp": 1.0}],
)  # fmt: skip
def test_lids_stay_in_front_of_the_eyeball(weights: dict[str, float]) -> None:
    eye = HEAD.build.eye
    for part in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0):
        given = {f"{name}Left": part * weight for name, weight in weights.items()}
        take = tracked(tuple(given), np.array([[*given.values()]]))
        vertices = RIG.deform(stand_in_weights(take))[0]
        for row in (LID_EDGE, 2):
            loop = vertices[HEAD.lids[row]]
            middles = (loop + np.roll(loop, 1, axis=0)) / 2
            for points in (loop, middles):
                assert (np.linalg.norm((points - eye.centre) / eye.ball, axis=1) > 1).all()


def test_lids_close_and_never_pass_each_other() -> None:
    edge = posed(eyeBlinkLeft=1.0)[HEAD.lids[LID_EDGE]]
    opposite = (-np.arange(len(edge))) % len(edge)
    np.testing.assert_allclose(edge, edge[opposite], atol=2 / 4096)  # to which shapes are rounded
    others = ("eyeBlinkLeft", "eyeSquintLeft", "eyeLookDownLeft", "eyeWideLeft")
    blink = np.linspace(0, 1.1, 23)
    values = np.column_stack([blink, np.ones((23, 2)), np.zeros(23)])
    for vertices in RIG.deform(stand_in_weights(tracked(others, values))):
        edge = vertices[HEAD.lids[LID_EDGE]]
        half = len(edge) // 2
        assert (edge[1:half, 1] - edge[opposite[1:half], 1] >= -0.01).all()


def test_an_open_jaw_shows_the_mouth_and_mouth_close_closes_its_lips() -> None:
    lips, half = HEAD.lips[LIP_EDGE], HEAD.lips.shape[1] // 2
    teeth, tongue = HEAD.pieces["lower teeth"], HEAD.pieces["tongue"]

    def gap(vertices: np.ndarray) -> float:
        return float(
            np.linalg.norm(vertices[lips[:half]] - vertices[lips[::-1][:half]], axis=1).max()
        )

    opened = posed(jawOpen=1.0)
    assert gap(opened) > 1.5
    assert (opened[np.r_[teeth, tongue], 1] < RIG.neutral[np.r_[teeth, tongue], 1]).all()
    assert gap(posed(jawOpen=1.0, mouthClose=1.0)) < 0.01
    out = posed(tongueOut=1.0)
    for vertices, way in ((out, 1), (RIG.neutral, -1)):
        lip = vertices[HEAD.lips[LIP_EDGE, -1], 2]
        assert way * (vertices[tongue, 2].max() - lip) > 0.5


def test_weights_of_phones_are_known_in_any_spelling() -> None:
    values = np.zeros((2, 61))
    csv = tuple(name[0].upper() + name[1:] for name in ARKIT_SHAPES + ARKIT_ANGLES)
    assert is_tracked(tracked(csv, values))
    assert is_tracked(tracked(tuple(f"face.{name}" for name in ARKIT_SHAPES), values[:, :52]))
    assert not is_tracked(tracked(("jaw", "mouth open", "smile", "a", "b", "c"), values[:, :6]))
    assert not is_tracked(tracked(("jawOpen",), values[:, :1]))
    assert not is_tracked(Take(np.arange(2.0), Source(np.zeros((2, 1, 3)), ("jawOpen",))))


def test_halves_make_a_whole_and_what_was_not_seen_is_blank() -> None:
    names = ("browInnerUp_L", "browInnerUp_R", "headYaw", "jawOpen")
    values = np.array([[0.2, 0.6, 2.0, np.nan], [np.nan] * 4])
    weights = stand_in_weights(tracked(names, values))
    assert weights[0, ARKIT_SHAPES.index("browInnerUp")] == pytest.approx(0.4)
    assert weights[0].sum() == pytest.approx(0.4)
    seen, lost = stand_in_face(tracked(names, values)).motion.fetch(np.arange(2))
    assert np.isfinite(seen).all()
    assert np.isnan(lost).all()


def test_weights_in_percent_are_shown_as_shares(caplog) -> None:
    names, shares = ARKIT_SHAPES[:6], np.linspace(0, 1, 60).reshape(10, 6)
    expected = stand_in_weights(tracked(names, shares))
    assert not caplog.records
    np.testing.assert_allclose(stand_in_weights(tracked(names, 100 * shares)), expected)
    assert "taken for percent" in caplog.text
