import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, RBFInterpolator

from facert.errors import InputError
from facert.topology.affine import scaled_source
from facert.topology.keyed import KeyedPerformance, even_keys
from facert.topology.local_ridge import PENALTIES, _dual_weights
from facert.topology.propagation import METHODS, STILL, propagate
from facert.topology.radial_basis import radial_basis

FREE_OF_SPACE = [name for name in METHODS if name not in ("laplacian", "affine", "rbf-thin-plate")]


def performance(frames=60, points=7, every=8, seed=0, params=False):
    """A walk in four dimensions moves the points; the target follows it nonlinearly."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames)[:, None] / 30.0
    walk = np.sin(t * [2.0, 3.1, 4.3, 5.7] + rng.uniform(0, 6, 4))
    rest = 3.0 * rng.normal(size=(points, 3))
    shapes = 0.3 * rng.normal(size=(4, points, 3))
    source = rest + np.tensordot(walk, shapes, axes=1)
    truth = 2.0 * (rest + np.tensordot(walk + 0.1 * walk**2, shapes, axes=1))
    truth = truth.reshape(frames, 1, -1)[:, :, :5] if params else truth
    keys = even_keys(frames, every)
    return KeyedPerformance(source, keys, truth[keys]), truth


def error(found, truth):
    return np.sqrt(np.mean((found - truth) ** 2) / np.mean((truth - truth.mean(axis=0)) ** 2))


@pytest.mark.parametrize("method", list(METHODS))
def test_key_poses_are_met(method):
    take, truth = performance()
    found = propagate(take, method)
    assert found.shape == truth.shape
    tolerance = 0.3 if method in ("ridge", "affine") else 1e-6
    np.testing.assert_allclose(found[take.keys], take.labels, atol=tolerance)


@pytest.mark.parametrize("method", [name for name in METHODS if name != "laplacian"])
def test_parameters_follow_the_whole_face(method):
    take, truth = performance(params=True, every=2 if method == "rbf-thin-plate" else 8)
    assert error(propagate(take, method), truth) < 0.9
    if method in ("residual", "ridge", "affine"):
        assert error(propagate(take, method), truth) < 0.1


def test_the_frameworks_follow_better_than_time_or_distance_alone():
    take, truth = performance(frames=90, every=10)
    errors = {name: error(propagate(take, name), truth) for name in METHODS}
    assert errors["framework"] < 0.5 * errors["rbf-linear"]
    assert errors["framework"] < 0.7 * errors["spline"]
    assert errors["residual"] < min(errors["framework"], errors["ridge"])


@pytest.mark.parametrize("method", FREE_OF_SPACE)
def test_how_the_actor_turned_and_in_what_unit_does_not_matter(turn, method):
    take, _ = performance()
    placed = 100.0 * take.source @ turn + [4.0, 5.0, 6.0]
    moved = KeyedPerformance(placed, take.keys, take.labels)
    np.testing.assert_allclose(propagate(moved, method), propagate(take, method), atol=1e-8)


@pytest.mark.parametrize("method", list(METHODS))
def test_labels_moved_and_scaled_move_and_scale_the_target(method):
    take, _ = performance()
    moved = KeyedPerformance(take.source, take.keys, 3.0 * take.labels + [1.0, -2.0, 4.0])
    expected = 3.0 * propagate(take, method) + [1.0, -2.0, 4.0]
    np.testing.assert_allclose(propagate(moved, method), expected, atol=1e-8)


@pytest.mark.parametrize("method", list(METHODS))
def test_the_order_of_keys_and_of_points_does_not_matter(method):
    take, _ = performance()
    rng = np.random.default_rng(0)
    keys, points = rng.permutation(len(take.keys)), rng.permutation(7)
    mixed = KeyedPerformance(take.source[:, points], take.keys[keys], take.labels[keys][:, points])
    found = propagate(mixed, method)
    np.testing.assert_allclose(found, propagate(take, method)[:, points], atol=1e-8)


def test_affine_relations_are_found_exactly_by_the_framework_and_the_regression(monkeypatch):
    monkeypatch.setattr("facert.topology.propagation.STILL", 1e-6)  # all directions count
    take, _ = performance()
    rng = np.random.default_rng(5)
    maps = rng.normal(size=(7, 3, 3))
    truth = np.einsum("tpc,pcd->tpd", take.source, maps) + rng.normal(size=(7, 3))
    exact = KeyedPerformance(take.source, take.keys, truth[take.keys])
    for method in ("framework", "literal"):
        np.testing.assert_allclose(propagate(exact, method), truth, atol=1e-6)
    np.testing.assert_allclose(propagate(exact, "affine"), truth, atol=1e-6)


def test_displacements_and_positions_are_one_problem_where_affine_maps_cost_nothing(monkeypatch):
    monkeypatch.setattr("facert.topology.propagation.STILL", 1e-8)
    take, _ = performance()
    np.testing.assert_allclose(propagate(take, "framework"), propagate(take, "literal"), atol=1e-6)


@pytest.mark.parametrize("method", ["framework", "path", "residual", "laplacian"])
def test_a_target_that_moves_as_the_scaled_source_does_is_found_however_little_a_window_shows(
    method,
):
    """Displacements from it are the same throughout; the positions of (9) would stand still."""
    take, _ = performance()
    source = take.source * [1.0, 1.0, 1e-3]
    truth = 2.5 * source + [1.0, 2.0, 3.0]
    similar = KeyedPerformance(source, take.keys, truth[take.keys])
    np.testing.assert_allclose(propagate(similar, method), truth, atol=1e-7)
    assert np.abs(propagate(similar, "literal") - truth).max() > 1e-3


def one_window(small, seed=0):
    """Frames that one window holds, and a control that is one of three motions.

    The second motion is so small beside the first, and alone moves the control.
    """
    rng = np.random.default_rng(seed)
    X, _ = np.linalg.qr(rng.normal(size=(40, 4)) * [0.0, 1.0, 1.0, 1.0] + [1.0, 0.0, 0.0, 0.0])
    X = X[:, 1:] * [1.0, small, 0.1]  # no mean
    keys = np.arange(0, 40, 2)
    poses = X[keys, None, 1:2] / small
    return KeyedPerformance(X[:, None], keys, poses)


@pytest.mark.parametrize("small", [0.003, 0.03, 0.3])
@pytest.mark.parametrize("method", ["framework", "literal"])
def test_with_all_frames_in_one_window_the_framework_is_a_ridge_regression(method, small):
    """Free frames then cost nothing beside D_i, whose penalty is μ², μ a share of the largest."""
    take = one_window(small)
    X, x = take.frames, take.frames[take.keys]
    penalty = (STILL * np.linalg.norm(X, 2)) ** 2 * np.eye(3)
    mean, labels = x.mean(axis=0), take.labels[:, 0]
    slopes = np.linalg.solve(
        (x - mean).T @ (x - mean) + penalty, (x - mean).T @ (labels - labels.mean(axis=0))
    )
    expected = (X - mean) @ slopes + labels.mean(axis=0)
    expected[take.keys] = labels
    found = propagate(take, method, width=81)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-8)


@pytest.mark.parametrize("method", ["framework", "literal"])
def test_a_direction_of_three_hundredths_is_motion_and_one_of_three_thousandths_is_noise(method):
    """Of the largest motion; between two keys the target then follows it, or does not."""

    def followed(small):
        take = one_window(small)
        between = np.arange(1, 40, 2)
        truth, found = take.frames[between, 1] / small, propagate(take, method, width=81)
        return np.polyfit(truth, found[between, 0, 0], 1)[0]

    assert followed(0.03) > 0.7
    assert followed(0.003) < 0.2


def test_the_path_term_is_a_tenth_of_the_path_laplacian_squared():
    """Added to the energy of Algorithm 1, damped: W of one window of all frames, T times."""
    take = one_window(0.1)
    U, s, _ = np.linalg.svd(take.frames, full_matrices=False)
    shares = s**2 / (s**2 + (0.01 * s[0]) ** 2)
    W = np.eye(40) - 1 / 40 - (U * shares) @ U.T
    L = np.eye(40) - (np.eye(40, k=1) + np.eye(40, k=-1)) / 2
    L[0, 1] = L[-1, -2] = -1.0
    B, free = 40 * W + 0.1 * L.T @ L, np.arange(1, 40, 2)
    right = B[np.ix_(free, take.keys)] @ take.labels[:, 0]
    expected = -np.linalg.solve(B[np.ix_(free, free)], right)
    found = propagate(take, "path", width=81)
    np.testing.assert_allclose(found[free, 0], expected, atol=1e-8)


@pytest.mark.parametrize(
    ("method", "width", "dim"), [("framework", 15, 3), ("path", 15, 3), ("residual", 9, 5)]
)
def test_windows_are_of_15_frames_and_space_or_of_9_and_five_directions_of_whole_frames(
    method, width, dim
):
    take, _ = performance()
    noise = 0.05 * np.random.default_rng(0).normal(size=take.source.shape)
    take = KeyedPerformance(take.source + noise, take.keys, take.labels)
    found = propagate(take, method)
    np.testing.assert_array_equal(found, propagate(take, method, width, dim))
    assert np.abs(found - propagate(take, method, width - 2, dim)).max() > 1e-6
    assert np.abs(found - propagate(take, method, width, dim - 1)).max() > 1e-6


@settings(max_examples=20, deadline=None)
@given(st.floats(0.01, 100.0), st.integers(0, 99))
def test_the_source_is_turned_and_scaled_onto_a_similar_target(scale, seed):
    take, _ = performance(seed=seed)
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    truth = scale * take.source @ (Q * np.sign(np.linalg.det(Q)))
    similar = KeyedPerformance(take.source, take.keys, truth[take.keys] + [1.0, 2.0, 3.0])
    np.testing.assert_allclose(scaled_source(similar), truth, atol=1e-9 * scale)


def test_leave_one_out_errors_are_those_of_leaving_each_key_out():
    """The closed form of the leave-one-out error, against leaving each key out."""
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(8, 5)), rng.normal(size=(8, 2))
    centre = np.eye(8) - 1 / 8
    _, errors = _dual_weights((centre @ X @ X.T @ centre)[None], (centre @ Y)[None])
    for penalty, error in zip(PENALTIES, errors, strict=True):
        missed = 0.0
        for left in range(8):
            x, y = np.delete(X, left, axis=0), np.delete(Y, left, axis=0)
            slope = np.linalg.solve(
                (x - x.mean(0)).T @ (x - x.mean(0)) + penalty * np.eye(5),
                (x - x.mean(0)).T @ (y - y.mean(0)),
            )
            missed += np.sum((Y[left] - y.mean(0) - (X[left] - x.mean(0)) @ slope) ** 2)
        assert error == pytest.approx(missed, rel=1e-6)


def test_the_baselines_are_the_ones_of_scipy():
    take, _ = performance()
    spline = CubicSpline(take.keys, take.labels)(np.arange(len(take)))
    np.testing.assert_allclose(propagate(take, "spline"), spline, atol=1e-12)
    for name, kernel in (("rbf-linear", "linear"), ("rbf-thin-plate", "thin_plate_spline")):
        X = take.source[:, 3]
        expected = RBFInterpolator(X[take.keys], take.labels[:, 3], kernel=kernel)(X)
        np.testing.assert_allclose(propagate(take, name)[:, 3], expected, atol=1e-8)


@pytest.mark.parametrize("method", list(METHODS))
@pytest.mark.parametrize("flat", [False, True])
def test_rounding_decides_nothing(method, flat):
    """Whole frames have 21 coordinates and 4 ways to move; flat points move along a line."""
    take, _ = performance(params=method != "laplacian" and not flat, every=2)
    source = take.source * [1.0, 0.0, 0.0] if flat else take.source
    rng = np.random.default_rng(0)
    once, twice = (
        propagate(KeyedPerformance(x, take.keys, take.labels), method)
        for x in (source, source * (1.0 + 1e-15 * rng.normal(size=source.shape)))
    )
    np.testing.assert_allclose(twice, once, atol=1e-7)


@pytest.mark.parametrize("kernel", ["linear", "thin_plate_spline"])
@pytest.mark.parametrize("span", [1, 2, 21])
def test_labels_in_a_line_or_a_plane_determine_a_radial_interpolation(kernel, span):
    rng = np.random.default_rng(span)
    X, values = rng.normal(size=(60, 21)), rng.normal(size=(22, 3))
    flat, _ = np.linalg.qr(rng.normal(size=(21, span)))
    X[:22] = X[:22] @ flat @ flat.T
    interpolated = radial_basis(X, np.arange(22), kernel)(values)
    np.testing.assert_allclose(interpolated[:22], values, atol=1e-8)
    moved = radial_basis(1e3 * X + 7.0, np.arange(22), kernel)(values)
    np.testing.assert_allclose(moved, interpolated, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("method", ["residual", "path", "laplacian", "ridge", "affine", "spline"])
def test_still_and_repeated_frames_do_no_harm(method):
    take, truth = performance()
    held = np.minimum(np.arange(60), 25)  # the second half stands still
    still = KeyedPerformance(take.source[held], take.keys, truth[held][take.keys])
    assert error(propagate(still, method), truth[held]) < 0.25


def test_windows_change_the_result_where_there_are_windows():
    take, _ = performance()
    assert not np.allclose(propagate(take, "path", width=5), propagate(take, "path"))
    assert not np.allclose(propagate(take, "path", dim=1), propagate(take, "path"))
    with pytest.raises(InputError, match="neither with spline"):
        propagate(take, "spline", width=5)
    for width in (4, 0, -5):
        with pytest.raises(InputError, match="odd"):
            propagate(take, "path", width=width)
    with pytest.raises(InputError, match="one of residual, path"):
        propagate(take, "magic")


def test_too_few_keys_are_refused():
    take, truth = performance()
    with pytest.raises(InputError, match="2 key frames or more"):
        KeyedPerformance(take.source, np.array([3]), truth[[3]])
    few = KeyedPerformance(take.source, np.array([0, 20, 40]), truth[[0, 20, 40]])
    with pytest.raises(InputError, match="4 or more in each connected component"):
        propagate(few, "literal")
    assert np.isfinite(propagate(few, "framework")).all()
    assert np.isfinite(propagate(few, "path")).all()


def test_bad_keys_and_labels_are_named():
    take, truth = performance()
    source = take.source
    with pytest.raises(InputError, match="from 0 to 59"):
        KeyedPerformance(source, np.array([0, 60]), truth[[0, 1]])
    with pytest.raises(InputError, match="5 twice"):
        KeyedPerformance(source, np.array([5, 5]), truth[[5, 5]])
    with pytest.raises(InputError, match="NaN"):
        KeyedPerformance(source, np.array([0, 5]), np.full((2, 7, 3), np.nan))
    with pytest.raises(InputError, match="1 or 7"):
        KeyedPerformance(source, np.array([0, 5]), truth[[0, 5]][:, :4])
    frozen = KeyedPerformance(source[np.zeros(60, int)], take.keys, take.labels)
    with pytest.raises(InputError, match="two at one place"):
        propagate(frozen, "rbf-linear")
    flat, _ = performance(params=True)
    with pytest.raises(InputError, match="a target position for each source marker"):
        propagate(flat, "laplacian")


def test_even_keys_hold_the_first_and_the_last_frame():
    assert even_keys(100, 30).tolist() == [0, 30, 60, 90, 99]
    assert even_keys(61, 30).tolist() == [0, 30, 60]
    with pytest.raises(InputError, match="--every"):
        even_keys(10, 0)
