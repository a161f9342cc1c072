"""Markers are parted by how they move."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert.regions.bipartition import together, two_groups

HEIGHTS = np.linspace(-9.0, 9.0, 13)


def make_face(frames=200, seed=0, noise=0.0, size=1.0):
    """Markers on a curved face: those above 2 follow the brows, the others the mouth."""
    rng = np.random.default_rng(seed)
    width = rng.uniform(-6.0, 6.0, len(HEIGHTS))
    places = np.stack([width, HEIGHTS, 10.0 - 0.1 * width**2], axis=1)
    upper = HEIGHTS > 2.0
    shapes = rng.normal(size=(6, len(HEIGHTS), 3))
    shapes[:3, ~upper] = 0.0
    shapes[3:, upper] = 0.0
    moved = np.tensordot(rng.normal(size=(frames, 6)), shapes, axes=1)
    moved[:, upper] *= size
    return places + moved * 0.3 + noise * rng.normal(size=moved.shape), upper


def same_parts(found, expected):
    return (found == expected).all() or (found == ~expected).all()


@pytest.mark.parametrize("size", [1.0, 0.02])
def test_what_moves_apart_is_parted_however_small(size):
    frames, upper = make_face(size=size)
    assert same_parts(two_groups(frames), upper)


@given(st.integers(0, 1000), st.floats(0.01, 100.0))
def test_neither_pose_nor_unit_of_the_head_matters(seed, unit):
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    frames, upper = make_face()
    assert same_parts(two_groups(unit * (frames @ turn) + rng.normal(size=3)), upper)


@given(st.permutations(range(len(HEIGHTS))))
def test_the_order_of_the_markers_does_not_matter(order):
    frames, upper = make_face()
    assert same_parts(two_groups(frames[:, order]), upper[list(order)])


def test_a_plane_parts_the_face_even_through_noise():
    frames, _ = make_face(noise=0.5)
    found = two_groups(frames)
    assert found.any()
    assert not found.all()
    places = frames.mean(axis=0)
    normal = places[found].mean(axis=0) - places[~found].mean(axis=0)
    assert abs(normal[1]) > 0.9 * np.linalg.norm(normal)  # one above, one below


@pytest.mark.parametrize("seed", [2, 3, 7])
def test_how_flat_markers_were_rounded_across_their_plane_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    places = rng.uniform(-5.0, 5.0, (20, 3)) * [1.0, 1.0, 0.0]
    inner = np.linalg.norm(places, axis=1) < 3.0
    together = rng.normal(size=(100, 1, 1)) * inner[:, None] * [1.0, 1.0, 0.0]
    frames = places + together + 0.1 * rng.normal(size=(100, 20, 3)) * [1.0, 1.0, 0.0]
    rounded = frames + 1e-8 * rng.normal(size=(20, 1)) * [0.0, 0.0, 1.0]
    assert same_parts(two_groups(rounded), two_groups(frames))


def test_weights_are_parted_without_places():
    rng = np.random.default_rng(0)
    upper = np.arange(10) < 4
    drive = rng.normal(size=(300, 2))
    weights = np.where(upper, drive[:, :1], drive[:, 1:]) + 0.1 * rng.normal(size=(300, 10))
    assert same_parts(two_groups(weights), upper)


def test_three_markers_cannot_be_parted():
    assert not two_groups(make_face()[0][:, :3]).any()


def test_rv_is_one_with_what_moves_alike_and_zero_with_what_is_still():
    rng = np.random.default_rng(0)
    a = rng.normal(size=(50, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    frames = np.stack([a, 7.0 * a @ turn, np.ones((50, 3))], axis=1)
    np.testing.assert_allclose(
        together(frames), [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]], atol=1e-12
    )


def test_rv_is_the_squared_correlation_of_single_coordinates():
    a = np.random.default_rng(0).normal(size=(40, 3))
    expected = np.corrcoef(a, rowvar=False) ** 2
    np.testing.assert_allclose(together(a[:, :, None]), expected, atol=1e-12)
