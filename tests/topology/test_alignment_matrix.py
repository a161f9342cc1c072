import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.errors import InputError
from facert.topology.alignment_matrix import alignment_matrix, tangent_coordinates
from facert.topology.neighbourhoods import Neighbourhoods, mesh_rings, temporal_windows


def algorithm_1(X, neighbourhoods, dim):
    """Algorithm 1 as it is printed, point after point."""
    B = np.zeros((len(X), len(X)))
    for members in np.split(neighbourhoods.members, np.cumsum(neighbourhoods.sizes)[:-1]):
        local, k = X[members], len(members)
        centred = local - local.mean(axis=0)
        g, s, _ = np.linalg.svd(centred, full_matrices=False)
        G = np.column_stack([np.full(k, 1 / np.sqrt(k)), g[:, :dim][:, s[:dim] > 1e-9]])
        B[np.ix_(members, members)] += np.eye(k) - G @ G.T
    return B


@pytest.mark.parametrize("dim", [0, 1, 2, 3])
def test_batches_build_what_algorithm_1_builds(sheet, dim):
    points, faces = sheet
    rings = mesh_rings(faces, len(points))
    B = alignment_matrix(points, rings, dim)
    np.testing.assert_allclose(B.toarray(), algorithm_1(points, rings, dim), atol=1e-12)


def test_tangent_coordinates_are_an_orthogonal_projection_and_reconstruct_a_plane(sheet):
    points, faces = sheet
    flat = points * [1, 1, 0]
    for members in mesh_rings(faces, len(points)).by_size():
        local = flat[members]
        centred = local - local.mean(axis=1, keepdims=True)
        g, spread = tangent_coordinates(local, 2)
        coordinates = g * spread[:, None, :]
        U = np.linalg.pinv(coordinates) @ centred  # (2): the points from their coordinates
        np.testing.assert_allclose(coordinates @ U, centred, atol=1e-12)
        np.testing.assert_allclose(centred @ U.transpose(0, 2, 1), coordinates, atol=1e-12)  # (1)


def test_B_is_symmetric_semidefinite_and_blind_to_constants(sheet):
    points, faces = sheet
    B = alignment_matrix(points, mesh_rings(faces, len(points)), 2).toarray()
    np.testing.assert_allclose(B, B.T, atol=1e-14)
    assert np.linalg.eigvalsh(B).min() > -1e-12
    np.testing.assert_allclose(B @ np.ones(len(points)), 0, atol=1e-12)


def test_affine_maps_of_the_source_cost_nothing_where_d_is_the_dimension_of_space(sheet, turn):
    points, faces = sheet
    rings = mesh_rings(faces, len(points))
    moved = points @ (turn * [1, 2, 3]) + 5
    B3, B2 = (alignment_matrix(points, rings, dim) for dim in (3, 2))
    np.testing.assert_allclose(B3 @ moved, 0, atol=1e-10)
    assert np.abs(B2 @ moved).max() > 1e-3


def test_B_does_not_know_how_the_source_lies_or_how_large_it_is(sheet, turn):
    points, faces = sheet
    rings = mesh_rings(faces, len(points))
    B = alignment_matrix(points, rings, 2)
    moved = alignment_matrix(700 * points @ turn + [3, -4, 5], rings, 2)
    np.testing.assert_allclose(moved.toarray(), B.toarray(), atol=1e-8)


def test_the_order_of_the_points_is_only_a_name(sheet):
    points, faces = sheet
    order = np.random.default_rng(0).permutation(len(points))
    place = np.argsort(order)  # where each point went
    B = alignment_matrix(points, mesh_rings(faces, len(points)), 2).toarray()
    shuffled = alignment_matrix(points[order], mesh_rings(place[faces], len(points)), 2)
    np.testing.assert_allclose(shuffled.toarray(), B[np.ix_(order, order)], atol=1e-10)


def test_frames_that_stand_still_have_no_direction_but_noise():
    rng = np.random.default_rng(0)
    X = np.zeros((60, 3))
    X[40:] = rng.normal(size=(20, 3)).cumsum(axis=0)
    X += 1e-6 * rng.normal(size=X.shape)
    windows = temporal_windows(60, 5)
    guarded = alignment_matrix(X, windows, 3, guard=0.01)[:30, :30].toarray()
    still = alignment_matrix(X, windows, 0)[:30, :30].toarray()
    np.testing.assert_allclose(guarded, still, atol=1e-6)
    assert np.abs(alignment_matrix(X, windows, 3)[:30, :30].toarray() - guarded).max() > 0.1


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-3, 1.0), st.integers(0, 99))
def test_a_guard_is_a_penalty_on_the_local_maps(guard, seed):
    """W of a single window is what (6) leaves of Y when D_i costs its square times μ²."""
    rng = np.random.default_rng(seed)
    X, Y = rng.normal(size=(7, 3)) * [1.0, 0.1, 0.01], rng.normal(size=(7, 2))
    window = Neighbourhoods(7, np.arange(7), np.array([7]))
    B = alignment_matrix(X, window, 3, guard).toarray()
    x, y = X - X.mean(axis=0), Y - Y.mean(axis=0)
    noise = guard * np.linalg.norm(x, 2)
    D = np.linalg.solve(x.T @ x + noise**2 * np.eye(3), x.T @ y)
    least = np.sum((y - x @ D) ** 2) + noise**2 * np.sum(D**2)
    assert np.trace(Y.T @ B @ Y) == pytest.approx(least, rel=1e-9)


def test_repeated_frames_do_no_harm():
    X = np.repeat(np.random.default_rng(0).normal(size=(8, 3)), 3, axis=0)
    B = alignment_matrix(X, temporal_windows(24, 7), 3)
    assert np.isfinite(B.toarray()).all()
    np.testing.assert_allclose(B @ X, 0, atol=1e-10)


def test_points_must_be_finite_and_as_many_as_the_neighbourhoods_choose_from(sheet):
    points, faces = sheet
    rings = mesh_rings(faces, len(points))
    broken = points.copy()
    broken[3, 1] = np.nan
    with pytest.raises(InputError, match="NaN"):
        alignment_matrix(broken, rings, 2)
    with pytest.raises(InputError, match="71 rows"):
        alignment_matrix(points[1:], rings, 2)
    with pytest.raises(InputError, match="dim"):
        alignment_matrix(points, rings, -1)
