import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.rig import Rig
from facert.topology.suggested_points import mirror_vertices, suggest_points


def half(seed, count=30):
    """Points of one half, away from the middle and from each other."""
    rng = np.random.default_rng(seed)
    return rng.permutation(np.mgrid[1:5, 0:4, 0:4].reshape(3, -1).T)[:count] + rng.uniform(
        -0.1, 0.1, (count, 3)
    )


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 99), st.integers(0, 2), st.floats(-50, 50))
def test_opposites_are_found_across_any_axis_and_wherever_the_face_is(seed, axis, place):
    right = half(seed)
    left = right * [-1, 1, 1]
    middle = np.stack([np.zeros(4), np.arange(4.0), np.arange(4.0)], axis=1)
    neutral = np.roll(np.concatenate([right, left, middle]), axis, axis=1) + place
    expected = np.concatenate([np.arange(30, 60), np.arange(30), np.arange(60, 64)])
    assert mirror_vertices(neutral).tolist() == expected.tolist()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 99))
def test_an_opposite_has_the_vertex_for_its_own(seed):
    neutral = np.random.default_rng(seed).normal(size=(40, 3))
    mirror = mirror_vertices(neutral)
    assert mirror[mirror].tolist() == list(range(40))


def test_a_face_without_symmetry_has_no_opposites(sheet):
    points, _ = sheet
    assert mirror_vertices(points).tolist() == list(range(len(points)))


@pytest.fixture
def face():
    """A symmetric sheet of 9 by 9 vertices with a bump on the left only."""
    y, x = np.mgrid[0.0:9.0, 0.0:9.0]
    neutral = np.stack([x, y, 0.1 * (x - 4) ** 2], axis=2).reshape(-1, 3)
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + 9], axis=1),
            np.stack([corner + 1, corner + 10, corner + 9], axis=1),
        ]
    )
    bump = np.exp(-np.sum((neutral - neutral[20]) ** 2, axis=1))[:, None] * [0.0, 0.1, 1.0]
    return Rig(neutral, bump[None], ["bump"], faces)


@pytest.mark.parametrize("count", [1, 2, 4, 7, 12, 19, 81])
def test_suggested_points_come_in_pairs(face, count):
    chosen = suggest_points(face, count)
    assert len(np.unique(chosen)) == count
    assert set(mirror_vertices(face.neutral)[chosen]) == set(chosen)
