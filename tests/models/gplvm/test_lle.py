import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import special_ortho_group
from sklearn.manifold._locally_linear import barycenter_kneighbors_graph

from facert.models.gplvm.lle import (
    CHUNK,
    constraint_matrix,
    nearest_neighbours,
    reconstruction_weights,
)


def cloud(n=30, d=5, seed=0):
    return np.random.default_rng(seed).normal(size=(n, d))


@given(st.integers(2, 25), st.integers(1, 6), st.integers(1, 9), st.integers(0, 100))
def test_weights_sum_to_one_and_no_point_rebuilds_itself(n, d, k, seed):
    C = reconstruction_weights(cloud(n, d, seed), k).toarray()
    np.testing.assert_allclose(C.sum(axis=1), 1.0)
    assert (C.diagonal() == 0.0).all()
    assert ((C != 0.0).sum(axis=1) <= k).all()


@settings(deadline=None)
@given(st.floats(1e-3, 1e3), st.integers(0, 100))
def test_weights_do_not_change_when_the_data_are_rotated_scaled_and_moved(scale, seed):
    U = cloud(20, 4)
    rotation = special_ortho_group.rvs(4, random_state=seed)
    moved = scale * (U @ rotation.T + 3.0)
    np.testing.assert_allclose(
        reconstruction_weights(moved, 6).toarray(),
        reconstruction_weights(U, 6).toarray(),
        atol=1e-6,
    )


@pytest.mark.parametrize("n", [30, CHUNK + 100])
def test_weights_are_those_of_scikit_learn(n):
    U = cloud(n)
    theirs = barycenter_kneighbors_graph(U, n_neighbors=8, reg=1e-3)
    np.testing.assert_allclose(reconstruction_weights(U, 8).toarray(), theirs.toarray(), atol=1e-10)


@pytest.mark.parametrize("dimensions", [1, 2])
def test_points_on_a_line_or_a_plane_are_rebuilt(dimensions):
    grid = np.stack(np.meshgrid(*[np.arange(9.0)] * dimensions), axis=-1).reshape(-1, dimensions)
    U = grid @ cloud(dimensions, 5)
    inside = ((grid > 1) & (grid < 7)).all(axis=1)
    C = reconstruction_weights(U, 4 if dimensions == 2 else 2)
    np.testing.assert_allclose((C @ U)[inside], U[inside], atol=1e-9)


def test_memory_is_linear_in_the_points():
    """Never a number for each pair of points and dimension: that would be 160 MB here."""
    U = cloud(2000, 5)
    tracemalloc.start()
    reconstruction_weights(U, 8)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10e6


def test_the_rebuilt_point_is_near_wherever_the_regularisation_is_felt():
    U = np.sort(np.random.default_rng(0).random((40, 1)), axis=0) @ np.ones((1, 3))
    residual = reconstruction_weights(U, 8) @ U - U
    assert np.abs(residual).max() < 0.02


def test_repeated_frames_are_never_their_own_neighbours():
    """More repeats than neighbours: a search need not find the row itself among them."""
    U = np.repeat(cloud(3, 2), 12, axis=0)
    neighbours = nearest_neighbours(U, 4)
    assert (neighbours != np.arange(len(U))[:, None]).all()
    assert all(len(set(row)) == 4 for row in neighbours.tolist())
    np.testing.assert_allclose(U[neighbours[:, 0]], U)


def test_points_that_all_coincide_still_have_weights():
    C = reconstruction_weights(np.ones((6, 3)), 3).toarray()
    np.testing.assert_allclose(C.sum(axis=1), 1.0)


def test_there_are_at_most_as_many_neighbours_as_other_points():
    assert nearest_neighbours(cloud(4), 8).shape == (4, 3)


LABELLED, SOURCE, TARGET = 6, 9, 4


def views():
    return cloud(LABELLED + SOURCE, 5, 1), cloud(LABELLED + TARGET, 3, 2)


def test_the_constraint_matrix_has_the_blocks_of_equation_6():
    X, Y = views()
    M = constraint_matrix(X, Y, LABELLED, 3).toarray()
    rows, columns = len(X), LABELLED + SOURCE
    residual_X = np.eye(len(X)) - reconstruction_weights(X, 3).toarray()
    residual_Y = np.eye(len(Y)) - reconstruction_weights(Y, 3).toarray()
    assert M.shape == (len(X) + len(Y), LABELLED + SOURCE + TARGET)
    np.testing.assert_array_equal(M[:rows, :columns], residual_X)
    np.testing.assert_array_equal(M[:rows, columns:], 0.0)
    np.testing.assert_array_equal(M[rows:, :LABELLED], residual_Y[:, :LABELLED])
    np.testing.assert_array_equal(M[rows:, LABELLED:columns], 0.0)
    np.testing.assert_array_equal(M[rows:, columns:], residual_Y[:, LABELLED:])


@pytest.mark.parametrize("labelled", [LABELLED, 10])
def test_constant_latent_coordinates_satisfy_every_constraint(labelled):
    """Also where the target has no rows of its own."""
    X, Y = views()
    M = constraint_matrix(X, Y, labelled, 3)
    np.testing.assert_allclose(M @ np.ones(M.shape[1]), 0.0, atol=1e-12)
