import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert.data.rig import Mesh
from facert.pages.paint import LEVELS, MOST, Scale, heat, skin
from facert.pages.stage import colour_layer

RNG = np.random.default_rng(0)
FACES = np.array([[i, i + 1, i + 2] for i in range(60)])
VERTICES = RNG.normal(size=(62, 3))


def test_a_mesh_of_few_colours_keeps_them() -> None:
    colours = np.array([[1.0, 0, 0], [0, 0, 1.0]])[(np.arange(62) > 30).astype(int)]
    paint = skin(Mesh(VERTICES, FACES, colours=colours))
    triangles = colours[FACES].mean(axis=1)
    np.testing.assert_allclose(paint.palette[paint.paint], triangles)


def test_of_many_colours_near_ones_remain() -> None:
    colours = RNG.random((62, 3))
    paint = skin(Mesh(VERTICES, FACES, colours=colours))
    triangles = colours[FACES].mean(axis=1)
    assert len(paint.palette) == MOST
    off = np.linalg.norm(paint.palette[paint.paint] - triangles, axis=1).mean()
    assert off < np.linalg.norm(triangles - triangles.mean(axis=0), axis=1).mean() / 2


def test_a_mesh_without_colours_is_clay_all_over() -> None:
    paint = skin(Mesh(VERTICES, FACES))
    assert len(paint.palette) == 1
    assert not paint.paint.any()


def test_the_scale_runs_from_nothing_to_its_top_and_stays_there() -> None:
    values = np.repeat([0.0, 0.5, 1.0, 7.0], 3)
    paint = Scale(1.0).paint(values, np.arange(12).reshape(4, 3))
    assert paint.paint.tolist() == [0, LEVELS // 2, LEVELS - 1, LEVELS - 1]


def test_the_colours_of_the_scale_darken_all_the_way() -> None:
    lightness = heat() @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness[2:]) < 0).all()


@given(st.floats(1e-6, 1e6))
def test_a_scale_ends_at_a_round_number_not_far_above_its_values(value: float) -> None:
    top = Scale.of(np.full(9, value), "cm").top
    assert value * 0.99 <= top <= 2.6 * value
    assert f"{top:.0e}"[0] in "125"


def test_a_scale_of_nothing_has_a_top() -> None:
    assert Scale.of(np.zeros(0), "cm").top == 1.0
    assert Scale.of(np.zeros(5), "cm").top == 1.0


def test_the_legend_escapes_the_units() -> None:
    assert "<script" not in Scale(1.0, "<script>").legend


@pytest.mark.parametrize("seed", range(3))
def test_pieces_show_each_triangle_once_with_all_its_neighbours(seed: int) -> None:
    faces = np.random.default_rng(seed).integers(0, 20, (30, 3))
    chosen = np.random.default_rng(seed + 9).random(30) < 0.4
    piece = colour_layer(faces, chosen)
    triangles = piece.used[piece.faces]
    whole = piece.own[piece.faces].all(axis=1)
    shown = {tuple(triangle) for triangle in triangles[whole].tolist()}
    assert {tuple(triangle) for triangle in faces[chosen].tolist()} <= shown
    own = set(faces[chosen].ravel().tolist())
    touching = [face for face in faces.tolist() if own & set(face)]
    assert triangles.tolist() == touching
    assert set(piece.used[piece.own].tolist()) == own


def test_a_piece_of_nothing_is_empty() -> None:
    assert len(colour_layer(FACES, np.zeros(len(FACES), dtype=bool)).faces) == 0
