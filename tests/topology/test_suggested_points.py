import numpy as np
import pytest

from facert.data.rig import Rig
from facert.errors import InputError
from facert.topology.driving import FaceDriver, smooth_energy
from facert.topology.solution import Elimination
from facert.topology.suggested_points import (
    EVEN,
    _evened,
    rim_vertices,
    suggest_points,
)


@pytest.fixture
def rig(sheet):
    """A sheet with five bumps."""
    points, faces = sheet
    centres = points[[10, 21, 37, 45, 61]]
    distance = np.linalg.norm(points[None] - centres[:, None], axis=2)
    bumps = np.exp(-(distance**2))[:, :, None] * [0.0, 0.2, 1.0]
    return Rig(points, bumps, ["a", "b", "c", "d", "e"], faces)


def test_the_rim_is_the_border_of_the_sheet(sheet):
    _, faces = sheet
    inner = np.arange(72).reshape(9, 8)[1:-1, 1:-1]
    assert rim_vertices(faces).tolist() == np.setdiff1d(np.arange(72), inner).tolist()


def test_points_are_different_and_a_smaller_number_gives_a_like_beginning(rig):
    many = suggest_points(rig, 20)
    assert len(np.unique(many)) == 20
    assert many[0] == 0
    assert np.isin(suggest_points(rig, 12)[2:], suggest_points(rig, 16)).mean() > 0.6


def test_each_point_is_where_the_driver_misses_most(rig):
    chosen = suggest_points(rig, 12)
    for count in range(3, 12):
        driver = FaceDriver(rig.neutral, rig.faces, chosen[:count])
        posed = rig.neutral + rig.shapes / np.sqrt(_size(rig))[:, None, None] ** EVEN
        missed = np.sum((driver.deform(posed[:, chosen[:count]]) - posed) ** 2, axis=(0, 2))
        assert missed[chosen[count]] == pytest.approx(missed.max(), rel=1e-6)


def _size(rig):
    return np.mean(np.sum(rig.shapes**2, axis=2), axis=1)


def test_no_vertex_is_missed_as_much_as_with_points_at_random(rig):
    def error(points):
        driver = FaceDriver(rig.neutral, rig.faces, points)
        posed = rig.deform(np.eye(5))
        return np.abs(driver.deform(posed[:, points]) - posed).max()

    rng = np.random.default_rng(0)
    others = [error(rng.permutation(72)[:14]) for _ in range(10)]
    assert error(suggest_points(rig, 14)) < min(others)


def test_a_column_of_the_green_function_is_the_inverse(rig):
    energy = smooth_energy(rig.neutral, rig.faces)
    free = np.setdiff1d(np.arange(72), [3, 50])
    expected = np.linalg.inv(energy.toarray()[np.ix_(free, free)])[:, 7]
    found = Elimination(energy, np.array([3, 50])).green(int(free[7]))
    np.testing.assert_allclose(found[free], expected, atol=1e-9 * np.abs(expected).max())


def test_every_part_of_the_mesh_gets_a_point(two_sheets):
    points, faces = two_sheets
    shapes = np.zeros((1, 144, 3))
    shapes[0, 30] = 1
    chosen = suggest_points(Rig(points, shapes, ["a"], faces), 10)
    assert (chosen < 72).any()
    assert (chosen >= 72).any()


def test_bad_input_is_named(rig):
    with pytest.raises(InputError, match="-n"):
        suggest_points(rig, 500)
    still = Rig(rig.neutral, 0 * rig.shapes, rig.names, rig.faces)
    with pytest.raises(InputError, match="move something"):
        suggest_points(still, 10)


def test_a_shape_sixteen_times_as_large_counts_eight_times_as_much():
    shape = np.random.default_rng(0).normal(size=(72, 3))
    columns = _evened(np.stack([shape, 16.0 * shape, 0.0 * shape]))
    small, large = columns[:, :3], columns[:, 3:]
    assert columns.shape == (72, 6)  # what never moves tells nothing
    np.testing.assert_allclose(large, 8.0 * small)
