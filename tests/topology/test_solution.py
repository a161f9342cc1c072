import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from facert.errors import InputError
from facert.topology.alignment_matrix import alignment_matrix
from facert.topology.labels import (
    checked_labels,
    lacking_components,
    needed_labels,
    require_enough_labels,
)
from facert.topology.neighbourhoods import mesh_rings, temporal_windows
from facert.topology.solution import Dense, Elimination

LABELLED = np.array([70, 3, 20, 41, 11, 60])


def equation_18(B, labelled, labels, beta):
    """The solution for labels of the weight β, as it is written."""
    left, right = B.toarray(), np.zeros((B.shape[0], labels.shape[1]))
    left[labelled, labelled] += beta
    right[labelled] = beta * labels
    return np.linalg.solve(left, right)


@pytest.fixture
def B(sheet):
    points, faces = sheet
    return alignment_matrix(points, mesh_rings(faces, len(points)), 2)


@pytest.fixture
def labels(sheet):
    return sheet[0][LABELLED] + np.random.default_rng(1).normal(size=(6, 3))


def objective_9(values, X, windows, dim, labelled, labels, beta):
    """Equation (9) and its gradient, the affine maps (D_i, c_i) unknowns like the points."""
    N, D = X.shape
    Y = values[: N * D].reshape(N, D)
    maps = values[N * D :].reshape(-1, dim + 1, D)
    total = beta * np.sum((Y[labelled] - labels) ** 2)
    dY, dmaps = np.zeros_like(Y), np.zeros_like(maps)
    dY[labelled] = 2 * beta * (Y[labelled] - labels)
    for i, members in enumerate(windows):
        centred = X[members] - X[members].mean(axis=0)
        _, _, U = np.linalg.svd(centred, full_matrices=False)
        design = np.column_stack([centred @ U[:dim].T, np.ones(len(members))])  # (1)
        error = Y[members] - design @ maps[i]
        total += np.sum(error**2)
        dY[members] += 2 * error
        dmaps[i] -= 2 * design.T @ error
    return total, np.concatenate([dY.ravel(), dmaps.ravel()])


def test_the_closed_form_is_the_minimum_of_equation_9():
    rng = np.random.default_rng(0)
    X, labelled = rng.normal(size=(9, 3)).cumsum(axis=0), np.array([0, 4, 8, 6])
    labels = rng.normal(size=(4, 3))
    neighbourhoods = temporal_windows(9, 5)
    windows = np.split(neighbourhoods.members, np.cumsum(neighbourhoods.sizes)[:-1])
    arguments = (X, windows, 2, labelled, labels, 3.0)
    found = minimize(
        objective_9,
        np.zeros(9 * 3 + 9 * 3 * 3),
        args=arguments,
        jac=True,
        method="BFGS",
        options={"gtol": 1e-11, "maxiter": 5000},
    )
    closed = equation_18(alignment_matrix(X, neighbourhoods, 2), labelled, labels, 3.0)
    np.testing.assert_allclose(found.x[:27].reshape(9, 3), closed, atol=1e-6)


def test_weights_come_to_elimination_as_they_grow(B, labels):
    exact = Elimination(B, LABELLED)(labels)
    soft = (equation_18(B, LABELLED, labels, beta) for beta in (1e2, 1e4, 1e6))
    gaps = [np.abs(Y - exact).max() for Y in soft]
    assert gaps[0] > 50 * gaps[1] > 50 * 50 * gaps[2]
    np.testing.assert_array_equal(exact[LABELLED], labels)


def test_elimination_leaves_no_force_on_free_points(B, labels):
    Y = Elimination(B, LABELLED)(labels)
    free = np.setdiff1d(np.arange(72), LABELLED)
    np.testing.assert_allclose((B @ Y)[free], 0, atol=1e-10)


def test_the_influence_matrix_is_the_solution(B, labels):
    solution = Elimination(B, LABELLED)
    np.testing.assert_allclose(solution.influence @ labels, solution(labels), atol=1e-11)
    np.testing.assert_allclose(Dense(solution.influence)(labels), solution(labels), atol=1e-11)
    np.testing.assert_allclose(solution.influence.sum(axis=1), 1, atol=1e-9)


def test_all_frames_at_once_are_each_frame_alone(B):
    frames = np.random.default_rng(2).normal(size=(6, 5, 3))
    for solution in (Elimination(B, LABELLED), Dense(Elimination(B, LABELLED).influence)):
        together = solution(frames)
        assert together.shape == (72, 5, 3)
        for t in range(5):
            np.testing.assert_allclose(together[:, t], solution(frames[:, t]), atol=1e-12)


def test_the_order_of_the_labels_is_only_a_name(B, labels):
    order = np.array([3, 1, 5, 0, 2, 4])
    np.testing.assert_allclose(
        Elimination(B, LABELLED[order])(labels[order]), Elimination(B, LABELLED)(labels), atol=1e-8
    )


@settings(deadline=None, max_examples=15)
@given(shift=st.lists(st.floats(-100, 100), min_size=3, max_size=3), scale=st.floats(0.01, 100))
def test_labels_moved_and_scaled_move_and_scale_the_result(shift, scale):
    X = np.random.default_rng(0).normal(size=(30, 3)).cumsum(axis=0)
    labelled = np.array([2, 9, 16, 28])
    labels = np.random.default_rng(1).normal(size=(4, 3))
    solution = Elimination(alignment_matrix(X, temporal_windows(30, 9), 2), labelled)
    expected = scale * solution(labels) + shift
    np.testing.assert_allclose(
        solution(scale * labels + shift), expected, atol=1e-8 * max(scale, 1, *map(abs, shift))
    )


def test_every_point_a_label_is_the_labels(B, sheet):
    points, _ = sheet
    np.testing.assert_array_equal(Elimination(B, np.arange(72))(points), points)


def test_labels_on_a_line_do_not_hold_an_affine_map(sheet):
    points, faces = sheet
    B = alignment_matrix(points, mesh_rings(faces, len(points)), 3)
    with pytest.raises(InputError, match="labels that determine every point"):
        Elimination(B, np.array([5, 40, 61]))
    assert np.isfinite(Elimination(B, np.array([5, 40, 61, 2])).influence).all()


def test_a_part_without_labels_is_named_before_anything_is_solved(two_sheets):
    points, faces = two_sheets
    rings = mesh_rings(faces, len(points))
    assert lacking_components(rings, np.array([5, 70])).tolist() == [1]
    with pytest.raises(InputError, match=r"point 72 \(72 in all\)"):
        require_enough_labels(rings, np.array([5, 70]))
    require_enough_labels(rings, np.array([5, 100]))


def test_affine_freedom_needs_one_label_more_than_there_are_coordinates(two_sheets):
    points, faces = two_sheets
    assert [needed_labels(dim, 3) for dim in (1, 2, 3, 4)] == [1, 1, 4, 4]
    rings = mesh_rings(faces, len(points))
    with pytest.raises(InputError, match="4 or more"):
        require_enough_labels(rings, np.array([0, 20, 40, 60, 80]), 4)


def test_what_is_missed_by_the_count_is_found_by_the_factorisation(two_sheets):
    points, faces = two_sheets
    B = alignment_matrix(points, mesh_rings(faces, len(points)), 2)
    with pytest.raises(InputError, match="labels that determine every point"):
        Elimination(B, np.array([5, 70]))


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ([3, 99], "found .99."),
        ([-1], "found .-1."),
        ([], "found none"),
        ([2, 5, 2], "2 twice"),
        ([0.5, 1.0], "whole numbers"),
    ],
)
def test_labels_are_different_points(given, expected):
    with pytest.raises(InputError, match=expected):
        checked_labels(given, 72)
