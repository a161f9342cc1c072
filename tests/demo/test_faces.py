"""Both heads are sound meshes whose lids close and whose lips meet and part."""

from __future__ import annotations

import numpy as np
import pytest

from facert.demo import build
from facert.demo.expressions import ACTIVATIONS, expressions
from facert.demo.head import Head, make_head
from facert.demo.skin import LID_EDGE, LIP_EDGE

HEADS = {"actor": make_head(build.ACTOR), "character": make_head(build.CHARACTER)}


@pytest.fixture(params=HEADS, name="head")
def _head(request: pytest.FixtureRequest) -> Head:
    return HEADS[request.param]


def posed(head: Head, **activations: float) -> np.ndarray:
    weights = np.array([activations.get(name, 0.0) for name in ACTIVATIONS])
    return head.vertices + np.tensordot(weights, expressions(head), axes=1)


def lid_gap(head: Head, vertices: np.ndarray) -> float:
    """Widest opening between the upper and the lower lid."""
    edge = vertices[head.lids[LID_EDGE]]
    opposite = (-np.arange(len(edge))) % len(edge)
    return float(np.abs(edge[:, 1] - edge[opposite, 1]).max())


def lip_gap(head: Head, vertices: np.ndarray) -> float:
    """Widest opening between the lips."""
    edge = vertices[head.lips[LIP_EDGE]]
    return float(np.linalg.norm(edge - edge[::-1], axis=1).max())


def test_no_triangle_is_degenerate(head: Head) -> None:
    corners = head.vertices[head.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert area.min() > 1e-5


def test_every_edge_is_walked_once_in_each_direction(head: Head) -> None:
    edges = np.concatenate([head.faces[:, [0, 1]], head.faces[:, [1, 2]], head.faces[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges)


def test_skin_in_front_faces_the_viewer(head: Head) -> None:
    corners = head.vertices[head.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middle = corners.mean(axis=1)
    cheek = np.linalg.norm(middle[:, :2] - head.build.cheek, axis=1) < 1.0
    assert (normal[cheek & (middle[:, 2] > 2), 2] > 0).all()


def test_both_halves_mirror_each_other(head: Head) -> None:
    np.testing.assert_array_equal(head.mirror[head.mirror], np.arange(len(head.vertices)))
    np.testing.assert_array_equal(head.vertices[head.mirror], head.vertices * [-1, 1, 1])


def test_every_vertex_belongs_to_a_triangle(head: Head) -> None:
    assert len(np.unique(head.faces)) == len(head.vertices)


def test_a_blink_closes_the_lids(head: Head) -> None:
    open_gap = lid_gap(head, head.vertices)
    assert open_gap > 0.9
    assert lid_gap(head, posed(head, blink_L=1.0)) < 1e-9


def test_closing_lids_pass_in_front_of_the_eyeball(head: Head) -> None:
    eye = head.build.eye
    for closed in (0.25, 0.5, 0.75, 1.0):
        edge = posed(head, blink_L=closed)[head.lids[LID_EDGE]]
        assert (np.linalg.norm((edge - eye.centre) / eye.ball, axis=1) > 1).all()


def test_wide_eyes_are_wider(head: Head) -> None:
    assert lid_gap(head, posed(head, eye_wide=1.0)) > 1.2 * lid_gap(head, head.vertices)


@pytest.mark.parametrize("name", ["pucker", "lips_press", "smile_L", "frown_R", "mouth_left"])
def test_lips_that_are_not_parted_meet(head: Head, name: str) -> None:
    assert lip_gap(head, head.vertices) < 0.05
    assert lip_gap(head, posed(head, **{name: 1.0})) < 0.15


@pytest.mark.parametrize("name", ["jaw_open", "funnel", "upper_lip_up", "lower_lip_down"])
def test_lips_part(head: Head, name: str) -> None:
    assert lip_gap(head, posed(head, **{name: 1.0})) > 0.4


def test_every_expression_moves_the_face_by_millimetres(head: Head) -> None:
    size = np.linalg.norm(expressions(head), axis=2).max(axis=1)
    assert (size > 0.2).all()
    assert (size < 4.5).all()


def test_right_expressions_mirror_the_left_ones(head: Head) -> None:
    shapes = dict(zip(ACTIVATIONS, expressions(head), strict=True))
    for name in ("blink", "smile", "frown", "brow_down", "brow_outer_up"):
        np.testing.assert_allclose(
            shapes[f"{name}_R"], shapes[f"{name}_L"][head.mirror] * [-1, 1, 1], atol=1e-12
        )


def test_the_heads_are_built_differently() -> None:
    actor, character = HEADS["actor"], HEADS["character"]
    assert 1500 <= len(actor.vertices) <= 3500
    assert len(actor.vertices) != len(character.vertices)
