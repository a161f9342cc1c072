"""Pictures show what they should."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.rig import MeshSequence, Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.mesh.normals import vertex_normals
from facert.render import raster
from facert.render.faces import choose_frames, control_settings, posed_face
from facert.render.plots import plot_controls
from facert.render.raster import rasterise
from facert.render.shade import Camera, frame_mesh, shade
from facert.render.sheet import render_sheet

SQUARE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
FRONT = np.array([[0, 1, 2], [0, 2, 3]])
CAMERA = Camera((0.0, 0.0, 0.0), 2.0)


def take_with(params: np.ndarray, names: tuple[str, ...] = ("up", "wide")) -> Take:
    markers = np.random.default_rng(0).normal(size=(len(params), 5, 3))
    return Take(
        time=np.arange(len(params)) / 30,
        source=Source(markers, tuple("abcde")),
        controls=Controls(names),
        params=params,
    )


RIG = Rig(SQUARE, np.stack([SQUARE * [0, 1, 0], SQUARE * [1, 0, 0]]), ("up", "wide"), FRONT)
TAKE = take_with(np.random.default_rng(1).uniform(size=(20, 2)))
FACE = posed_face(TAKE, RIG, "character")


def test_a_square_covers_its_share_of_the_picture() -> None:
    picture = shade(SQUARE, FRONT, CAMERA, 64)
    assert picture.shape == (64, 64, 4)
    assert picture[..., 3].mean() == pytest.approx(0.25, abs=0.02)
    assert picture[32, 32, 3] == 1
    assert picture[2, 2, 3] == 0


def test_the_inside_of_a_mesh_is_dark() -> None:
    outside, inside = (shade(SQUARE, faces, CAMERA, 32) for faces in (FRONT, FRONT[:, ::-1]))
    assert inside[16, 16, :3].max() < 0.5 * outside[16, 16, :3].min()


def test_a_hole_in_a_mask_is_dark() -> None:
    ring = np.vstack([SQUARE, 0.4 * SQUARE])
    faces = np.array([[i, j, k] for i in range(4) for j, k in [((i + 1) % 4, i + 4)]])
    faces = np.vstack([faces, [[(i + 1) % 4, (i + 1) % 4 + 4, i + 4] for i in range(4)]])
    middle, band = (shade(ring, faces, CAMERA, 32)[row, 16] for row in (16, 10))
    assert middle[3] == band[3] == 1
    assert middle[:3].max() < 0.5 * band[:3].min()


def test_the_nearer_triangle_hides_the_other() -> None:
    vertices = np.vstack([SQUARE, SQUARE + np.array([0, 0, 1])])
    colours = np.repeat([[1.0, 0, 0], [0, 0, 1.0]], 4, axis=0)
    for faces in (np.vstack([FRONT, FRONT + 4]), np.vstack([FRONT + 4, FRONT])):
        red, _, blue, _ = shade(vertices, faces, CAMERA, 32, colours)[16, 16]
        assert blue > 5 * red


def test_triangles_in_parts_make_the_same_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    pixels, values = rng.uniform(-10, 42, (60, 3)), rng.normal(size=(60, 3))
    faces = rng.integers(0, 60, (80, 3))
    monkeypatch.setattr(raster, "MAX_LAYERS", 80)
    whole = rasterise(pixels, values, values, faces, 32)
    monkeypatch.setattr(raster, "_BATCH", 100)
    parts = rasterise(pixels, values, values, faces, 32)
    for name in ("covered", "depth", "normal", "colour", "inside"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))


def test_a_thousand_layers_over_each_other_are_refused() -> None:
    """They would take gibibytes, and show nothing but the first."""
    with pytest.raises(InputError, match=r"faces: expected at most 32 above each other, found \d+"):
        shade(SQUARE, np.tile(FRONT, (1000, 1)), CAMERA, 64)
    assert shade(SQUARE, np.tile(FRONT, (30, 1)), CAMERA, 64)[32, 32, 3] == 1


@settings(deadline=None, max_examples=25)
@given(st.lists(st.tuples(*[st.floats(-10, 42)] * 3), min_size=3, max_size=3))
def test_any_triangle_stays_on_the_picture(corners: list[tuple[float, float, float]]) -> None:
    pixels = np.array(corners)
    surface = rasterise(pixels, np.ones((3, 3)), np.ones((3, 3)), np.array([[0, 1, 2]]), 32)
    assert surface.covered.shape == (32, 32)
    depth = surface.depth
    assert len(depth) == surface.covered.sum()
    assert ((depth >= pixels[:, 2].min() - 1e-6) & (depth <= pixels[:, 2].max() + 1e-6)).all()


def test_normals_are_perpendicular() -> None:
    np.testing.assert_allclose(vertex_normals(SQUARE, FRONT), np.tile([0, 0, 1], (4, 1)))


def test_the_camera_sees_the_whole_mesh() -> None:
    pixels = frame_mesh(SQUARE + 7).project(SQUARE + 7, 100)
    assert ((pixels[:, :2] >= 0) & (pixels[:, :2] <= 99)).all()


def test_a_mesh_in_one_place_cannot_be_shown() -> None:
    with pytest.raises(InputError, match="/neutral: expected vertices apart from each other"):
        frame_mesh(np.ones((3, 3)))


def test_chosen_frames_differ_and_run_in_order() -> None:
    poses = np.repeat(np.eye(3), 10, axis=0)
    poses[4] = np.nan
    frames = choose_frames(poses, 3)
    assert [frame // 10 for frame in frames] == [0, 1, 2]
    assert 4 not in choose_frames(poses, 30)


def test_frames_cannot_be_chosen_without_poses() -> None:
    with pytest.raises(InputError, match="a pose in at least one frame"):
        choose_frames(np.full((4, 2), np.nan), 2)


def test_shapes_and_controls_meet_by_name() -> None:
    swapped = take_with(np.array([[0.25, 0.75]]), ("wide", "up"))
    np.testing.assert_array_equal(control_settings(swapped, RIG, [0]), [[0.75, 0.25]])


def test_a_control_without_a_side_drives_both_halves_in_any_spelling() -> None:
    rig = dataclasses.replace(RIG, names=("browInnerUp_L", "browInnerUp_R"))
    settings = control_settings(take_with(np.array([[0.3]]), ("BrowInnerUp",)), rig, [0])
    np.testing.assert_array_equal(settings, [[0.3, 0.3]])


def test_an_unknown_control_is_named_with_a_hint() -> None:
    with pytest.raises(InputError, match=r"'wider' \(did you mean 'wide'\?\)"):
        control_settings(take_with(np.ones((1, 2)), ("up", "wider")), RIG, [0])


def test_faces_have_a_row_each_for_markers_character_and_truth() -> None:
    assert len(render_sheet([FACE, FACE], [5], TAKE).axes) == 3
    weights = dataclasses.replace(TAKE, source=Source(np.ones((20, 2)), ("a", "b")))
    assert len(render_sheet([FACE], [5], weights).axes) == 1


def test_a_frame_without_a_pose_says_so() -> None:
    assert TAKE.params is not None
    params = TAKE.params.copy()
    params[3] = np.nan
    figure = render_sheet([posed_face(take_with(params), RIG, "character")], [3])
    assert "no pose" in [text.get_text() for text in figure.axes[0].texts]


@pytest.mark.parametrize("frames", [[20], [-1], []])
def test_frames_must_exist(frames: list[int]) -> None:
    with pytest.raises(InputError, match="--frames"):
        render_sheet([FACE], frames)


def test_the_truth_must_have_the_same_frames() -> None:
    with pytest.raises(InputError, match="--truth"):
        render_sheet([FACE, posed_face(take_with(np.ones((3, 2))), RIG, "truth")], [0])


def test_the_most_varying_controls_are_plotted() -> None:
    params = np.random.default_rng(2).normal(size=(30, 10)) * np.arange(10)
    take = take_with(params, tuple(f"c{index}" for index in range(10)))
    labels = [axes.get_ylabel() for axes in plot_controls(take).axes]
    assert labels == [f"c{index}" for index in range(2, 10)]


def test_truth_band_and_key_poses_are_drawn() -> None:
    assert TAKE.params is not None
    wavering = dataclasses.replace(TAKE, std=np.full((20, 2), 0.1))
    axes = plot_controls(wavering, TAKE, ["up"]).axes[0]
    assert len(axes.lines) == 2
    assert len(axes.collections) == 1
    params = TAKE.params.copy()
    params[::2] = np.nan
    keys = plot_controls(take_with(params), names=["up"]).axes[0].lines[0]
    assert len(keys.get_xdata()) == 10


def test_a_control_that_is_not_there_is_named() -> None:
    with pytest.raises(
        InputError, match="--controls: expected controls, or a pattern that some fit, found 'smile'"
    ):
        plot_controls(TAKE, names=["smile"])


def test_nothing_to_plot_without_poses() -> None:
    bare = Take(time=TAKE.time, source=TAKE.source)
    with pytest.raises(InputError, match="/target/params"):
        plot_controls(bare)


def test_a_take_whose_frames_all_lack_a_pose_is_not_drawn() -> None:
    empty = take_with(np.full((20, 2), np.nan))
    for draw in (lambda: plot_controls(empty), lambda: posed_face(empty, RIG, "character")):
        with pytest.raises(InputError, match="/target/params"):
            draw()


def test_a_picture_has_its_bounds() -> None:
    with pytest.raises(InputError, match="--controls: expected at most 40"):
        plot_controls(TAKE, names=["up"] * 41)
    with pytest.raises(InputError, match="--frames: expected at most 40"):
        render_sheet([FACE], [0] * 41)


@pytest.mark.parametrize("size", [1e16, 1e300, -1.7e308])
@pytest.mark.parametrize("entry", [(3, 1), ...])
def test_poses_of_absurd_size_are_refused_by_name(size, entry):
    params = np.array(TAKE.params)
    params[entry] = size
    absurd = take_with(params)
    drawn = (
        lambda: posed_face(absurd, RIG, "character"),
        lambda: plot_controls(absurd),
        lambda: plot_controls(dataclasses.replace(TAKE, std=np.abs(params))),
        lambda: plot_controls(TAKE, absurd),
    )
    for draw in drawn:
        with pytest.raises(InputError, match=r"target/(params|std): expected numbers of a sens"):
            draw()
    with pytest.raises(InputError, match="the rig's parameters"):
        RIG.deform(params)


def test_markers_and_vertices_of_absurd_size_are_refused_by_name():
    far = np.array(TAKE.source.values)
    far[2, 1, 0] = 1e300
    spiked = dataclasses.replace(TAKE, source=Source(far, TAKE.source.names))
    with pytest.raises(InputError, match="/source/markers"):
        render_sheet([FACE], [0], spiked)
    sequence = MeshSequence(RIG.mesh, TAKE.time, lambda _: np.full((1, 4, 3), 1e300))
    with pytest.raises(InputError, match="/vertices"):
        sequence.fetch(np.arange(1))


@pytest.mark.parametrize("size", [1e12, 1e20, 1e60])
def test_triangles_far_beyond_a_picture_are_drawn_within_it(size):
    pixels = SQUARE * [size, size, 1.0] + [size / 3, size / 7, 0.0]
    surface = rasterise(pixels, SQUARE, np.ones((4, 3)), FRONT, 16)
    assert np.isfinite(surface.depth).all()
    assert surface.covered.shape == (16, 16)


def test_axes_that_are_not_shown_make_no_ticks() -> None:
    sheet = render_sheet([FACE], [0, 1], TAKE, 64)
    assert not any(
        axis.get_major_ticks() for axes in sheet.axes for axis in (axes.xaxis, axes.yaxis)
    )
