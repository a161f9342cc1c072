"""A clip shows faces in motion, side by side, at an even pace."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from facert.data.rig import Mesh, MeshSequence
from facert.errors import InputError
from facert.render.clip import CAPTION, draw_clip, sampled_frames
from facert.render.faces import Face, choose_frames, frame_faces, outline, require_part
from facert.render.raster import rasterise
from facert.render.sheet import render_sheet

SQUARE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
MESH = Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]]))
SIZES = np.linspace(1.0, 0.1, 12)[:, None, None]


def face(label: str, vertices: np.ndarray) -> Face:
    time = np.arange(len(vertices)) / 30
    return Face(label, MeshSequence(MESH, time, lambda rows: vertices[rows]))


SHRINKING = face("shrinking", SQUARE * SIZES)
RESTING = face("resting", SQUARE * np.ones((12, 1, 1)))


def inked(picture: np.ndarray) -> float:
    return float((picture[24:60].min(axis=2) < 250).mean())


def test_each_face_has_its_place_and_its_motion() -> None:
    pictures = list(draw_clip([SHRINKING, RESTING], np.array([0, 6, 11]), 64))
    assert [picture.shape for picture in pictures] == [(64 + CAPTION, 128, 3)] * 3
    left, right = ([inked(half) for half in halves] for halves in zip(
        *((picture[:, :64], picture[:, 64:]) for picture in pictures), strict=True
    ))  # fmt: skip
    assert left[0] > left[1] > left[2] > 0
    assert right[0] == right[1] == right[2] == left[0]


def test_faces_shrink_alike_when_one_needs_more_room() -> None:
    growing = face("growing", SQUARE * (2.2 - SIZES))
    alone, beside = (frame_faces(faces, range(12)) for faces in ([RESTING], [RESTING, growing]))
    assert 1.1 * alone[0].reach < beside[0].reach == beside[1].reach
    assert frame_faces([SHRINKING], range(12))[0] == alone[0]
    assert frame_faces([face("lost", np.full((1, 4, 3), np.nan))], [0])[0] == alone[0]


def test_names_stand_below() -> None:
    first, second = (
        next(draw_clip([face(name, SQUARE[None])], np.array([0]), 64)) for name in "ab"
    )
    assert (first[:64] == second[:64]).all()
    assert (first[64:] != second[64:]).any()


def test_a_frame_without_a_pose_is_blank() -> None:
    lost = face("lost", np.full((1, 4, 3), np.nan))
    assert inked(next(draw_clip([lost], np.array([0]), 64))) == 0


def test_faces_of_different_lengths_are_refused() -> None:
    short = face("short", SQUARE[None])
    for draw in (lambda: next(draw_clip([SHRINKING, short], np.array([0]), 64)),
                 lambda: render_sheet([SHRINKING, short], [0])):  # fmt: skip
        with pytest.raises(InputError, match="short: expected 12 frames, found 1"):
            draw()


def test_a_sheet_has_a_row_a_face() -> None:
    assert len(render_sheet([SHRINKING, RESTING], [0, 5, 11], pixels=64).axes) == 6


@settings(deadline=None)
@given(st.lists(st.floats(0.01, 0.5), min_size=1, max_size=30), st.floats(5, 60), st.integers(0, 5))
def test_a_clip_takes_the_nearest_frame_at_every_moment(
    steps: list[float], fps: float, first: int
) -> None:
    time = np.cumsum(steps)
    part = range(min(first, len(time) - 1), len(time))
    moments = time[part.start] + np.arange(10**4) / fps
    moments = moments[moments <= time[-1] + 0.5 / fps]
    frames = sampled_frames(time, part, fps)
    assert abs(len(frames) - len(moments)) <= 1
    gaps = np.abs(time[part.start :] - moments[: len(frames), None]).min(axis=1)
    np.testing.assert_allclose(np.abs(time[frames[: len(gaps)]] - moments[: len(frames)]), gaps)


def test_an_even_take_plays_every_frame() -> None:
    np.testing.assert_array_equal(
        sampled_frames(np.arange(50) / 30, range(7, 20), 30), range(7, 20)
    )


@pytest.mark.parametrize("part", [range(5, 5), range(-1, 3), range(10, 13), range(12, 20)])
def test_a_part_lies_in_the_performance(part: range) -> None:
    with pytest.raises(InputError, match="--frames"):
        require_part(part, 12)


def test_the_outline_tells_frames_apart() -> None:
    assert (
        choose_frames(outline(SHRINKING.motion), 3)[:2]
        != choose_frames(outline(SHRINKING.motion), 3)[1:]
    )
    assert outline(SHRINKING.motion).shape == (12, 12)


@settings(deadline=None, max_examples=50)
@example([(0, 0, 0), (0, 1, 0), (1, 0, 0)], 0)
@given(st.lists(st.tuples(*[st.integers(-8, 40)] * 3), min_size=3, max_size=9), st.integers(0, 9))
def test_the_spans_of_the_rasteriser_are_the_pixels_of_the_triangles(
    corners: list[tuple[int, int, int]], shift: int
) -> None:
    """Against the definition: barycentric weights of every pixel in every triangle."""
    pixels = np.array(corners, dtype=float) + shift * np.array([0.125, 0.0625, 0])
    faces = np.array([[i, i + 1, i + 2] for i in range(len(corners) - 2)])
    surface = rasterise(pixels, np.ones_like(pixels), np.ones_like(pixels), faces, 32)
    row, column = np.mgrid[:32, :32]
    expected = np.full((32, 32), -np.inf)
    for a, b, c in pixels[faces]:
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        u = ((b[0] - column) * (c[1] - row) - (b[1] - row) * (c[0] - column)) / area
        v = ((c[0] - column) * (a[1] - row) - (c[1] - row) * (a[0] - column)) / area
        inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        depth = u * a[2] + v * b[2] + (1 - u - v) * c[2]
        expected = np.where(inside, np.maximum(expected, depth), expected)
    np.testing.assert_array_equal(surface.covered, np.isfinite(expected))
    np.testing.assert_allclose(surface.depth, expected[surface.covered], atol=1e-6)


def test_a_clip_of_years_is_refused() -> None:
    """A clock that was set anew in mid take makes a pause without an end."""
    time = np.array([0.0, 0.04, 1e9])
    with pytest.raises(InputError, match="clip: expected at most 1048576 frames, found 3e"):
        sampled_frames(time, range(3), 30.0)
    assert sampled_frames(time, range(2), 30.0).tolist() == [0, 1]
