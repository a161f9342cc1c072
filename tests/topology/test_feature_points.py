import numpy as np
import pytest

from facert.data.rig import Mesh
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.topology.feature_points import (
    carried_over,
    feature_points,
    mapped_vertices,
    named_vertices,
    nearest_vertices,
)

VERTICES = np.array([3, 20, 33, 50, 68])


def take_of(positions, names=("v3", "v20", "v33", "v50", "v68")):
    return Take(time=np.arange(len(positions)) / 30, source=Source(positions, names))


@pytest.fixture
def mesh(sheet):
    return Mesh(*sheet)


@pytest.fixture
def positions(mesh):
    """The first frame at rest."""
    steps = 0.02 * np.random.default_rng(0).normal(size=(12, 5, 3)).cumsum(axis=0)
    return mesh.vertices[VERTICES] + steps - steps[0]


def test_points_are_named_after_their_vertices(mesh, positions):
    found = feature_points(take_of(positions), mesh)
    assert found.vertices.tolist() == VERTICES.tolist()
    np.testing.assert_array_equal(found.positions, positions)
    assert named_vertices(["v12", "7", "V0"]).tolist() == [12, 7, 0]
    with pytest.raises(InputError, match="'chin'"):
        named_vertices(["v12", "chin"])


def test_a_map_names_vertices_in_any_spelling_and_leaves_points_out():
    points, vertices = mapped_vertices({"Chin": 7, "lip_L": 3}, ["lipLeft", "brow", "chin"])
    assert points.tolist() == [2, 0]
    assert vertices.tolist() == [7, 3]
    with pytest.raises(InputError, match="Did you mean 'chin'"):
        mapped_vertices({"chinn": 7}, ["chin", "brow"])
    for vertex in ("7", 7.0, True, {"a": 1}):
        with pytest.raises(InputError, match="number of a vertex"):
            mapped_vertices({"chin": vertex}, ["chin"])
    with pytest.raises(InputError, match="lines such as"):
        mapped_vertices({}, ["chin"])


def test_points_find_the_nearest_vertex(mesh, positions):
    take = take_of(positions + 0.01, "abcde")
    assert feature_points(take, mesh, "nearest").vertices.tolist() == VERTICES.tolist()
    with pytest.raises(InputError, match="nearest to several"):
        nearest_vertices(mesh.vertices[[4, 4]] + 0.001, mesh.vertices)
    with pytest.raises(InputError, match="half of them farther"):
        feature_points(take_of(positions + 50, "abcde"), mesh, "nearest")


def test_points_of_another_face_are_refused_or_carried_over(mesh, positions):
    other = 10.0 * positions + [100.0, 0.0, 0.0]
    with pytest.raises(InputError, match="--fit"):
        feature_points(take_of(other), mesh)
    for fit in ("uniform", "axes"):
        found = feature_points(take_of(other), mesh, fit=fit)
        np.testing.assert_allclose(found.positions, positions, atol=1e-9)


def test_axes_are_scaled_alone_where_asked(mesh, positions):
    home = mesh.vertices[VERTICES]
    wide = positions * [4.0, 1.0, 2.0]
    alone = carried_over(wide, wide[0], home, "axes")
    np.testing.assert_allclose(alone, positions, atol=1e-12)
    together = carried_over(wide, wide[0], home, "uniform")
    assert np.abs(together - positions).max() > 0.01
    np.testing.assert_allclose(together[0], home)
    with pytest.raises(InputError, match="flat"):
        carried_over(wide * [1, 1, 0], wide[0] * [1, 1, 0], home, "axes")


def test_any_frame_may_be_the_one_at_rest(mesh, positions):
    turned = positions[::-1]
    found = feature_points(take_of(10.0 * turned), mesh, rest=11, fit="uniform")
    np.testing.assert_allclose(found.positions, turned, atol=1e-9)
    with pytest.raises(InputError, match="--rest"):
        feature_points(take_of(turned), mesh, rest=12)


def test_gaps_are_filled_and_points_that_are_never_seen_left_out(mesh, positions):
    holed = positions.copy()
    holed[4, 1] = np.nan
    holed[:, 2] = np.nan
    found = feature_points(take_of(holed), mesh)
    assert found.vertices.tolist() == [3, 20, 50, 68]
    assert np.isfinite(found.positions).all()
    assert np.abs(found.positions[4, 1] - positions[4, 1]).max() < 0.1


def test_bad_points_are_named(mesh, positions):
    weights = Take(time=[0.0, 1.0], source=Source([[0.0, 1.0], [1.0, 0.0]], "ab"))
    with pytest.raises(InputError, match="markers"):
        feature_points(weights, mesh)
    with pytest.raises(InputError, match="from 0 to 71"):
        feature_points(take_of(positions, ("v3", "v20", "v33", "v50", "v99")), mesh)
    with pytest.raises(InputError, match="3 twice"):
        feature_points(take_of(positions, ("v3", "3", "v33", "v50", "v68")), mesh)
