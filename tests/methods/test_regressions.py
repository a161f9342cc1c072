"""What is particular to each of the regressions beside Gaussian processes."""

import tracemalloc

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator
from sklearn.cross_decomposition import PLSRegression
from sklearn.svm import SVR as ScikitSVR

from facert.data.arrays import rms
from facert.errors import InputError
from facert.methods.base import Labelled, Unlabelled
from facert.methods.folds import blocked_folds
from facert.methods.interpolation import SMOOTHING, NearestMap
from facert.methods.registry import make_method
from facert.methods.svr import PackedMap
from facert.models.partial_least_squares import LeastSquaresComponents
from facert.settings import Settings


def linear_data(n=30, noise=0.0, seed=0):
    """Frames of rank 6 in 15 dimensions, and poses that are linear in them."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, 6)) @ rng.normal(size=(6, 15))
    X -= X.mean(axis=0)
    return X, X @ rng.normal(size=(15, 4)) / 4.0 + noise * rng.normal(size=(n, 4))


def fitted(name, X, Y, settings=None):
    method = make_method(settings or Settings(method=name))
    method.fit(Labelled(X, Y), Unlabelled(X[:0], Y[:0]))
    return method


@pytest.mark.parametrize("name", ["ridge", "pls", "gpr-linear"])
def test_a_linear_truth_is_recovered(name):
    X, Y = linear_data(n=60)
    predicted = fitted(name, X[:30], Y[:30]).predict(X[30:]).Y
    np.testing.assert_allclose(predicted, Y[30:], atol=1e-3)


@pytest.mark.parametrize("name", ["ridge", "gpr-linear"])
def test_a_linear_truth_goes_on_far_beyond_the_labels(name):
    X, Y = linear_data(n=60)
    predicted = fitted(name, X[:30], Y[:30]).predict(1e3 * X[30:]).Y
    np.testing.assert_allclose(predicted, 1e3 * Y[30:], atol=1.0)


@pytest.mark.parametrize("name", ["ridge", "pls", "gpr-linear"])
def test_noise_is_not_followed(name):
    X, clean = linear_data(n=90)
    _, noisy = linear_data(n=90, noise=0.5)
    predicted = fitted(name, X[:60], noisy[:60]).predict(X[60:]).Y
    assert np.std(predicted - clean[60:]) < 0.6 * np.std(noisy - clean)


@pytest.mark.parametrize("name", ["ridge", "pls", "gpr-linear", "svr", "nearest"])
def test_the_unit_of_the_source_does_not_matter(name):
    """Also where so much noise asks for a large penalty."""
    X, Y = linear_data(noise=3.0)
    frames = linear_data(seed=1)[0]
    small, large = (fitted(name, unit * X, Y).predict(unit * frames).Y for unit in (1.0, 1e3))
    np.testing.assert_allclose(large, small, atol=1e-2)


def test_each_control_has_its_own_penalty():
    X, Y = linear_data()
    Y[:, 3] = np.random.default_rng(1).normal(size=len(Y))
    predicted = fitted("ridge", X, Y).predict(X).Y
    np.testing.assert_allclose(predicted[:, :3], Y[:, :3], atol=1e-3)
    assert predicted[:, 3].std() < 0.8 * Y[:, 3].std()


def test_all_numbers_of_components_come_from_one_fit():
    X, Y = linear_data(noise=0.1)
    poses = LeastSquaresComponents.of(X[:20], Y[:20], 5).outputs(X[20:], 5)
    for count in range(1, 6):
        expected = PLSRegression(count, scale=False, tol=1e-15).fit(X[:20], Y[:20]).predict(X[20:])
        np.testing.assert_allclose(poses[count - 1], expected, atol=1e-8)


def test_nearest_returns_poses_that_were_given():
    X, Y = linear_data()
    rng = np.random.default_rng(0)
    method = fitted("nearest", X, Y)
    np.testing.assert_array_equal(method.predict(X + 1e-6 * rng.normal(size=X.shape)).Y, Y)
    for pose in method.predict(2.0 * X).Y:
        assert (pose == Y).all(axis=1).any()


def test_interpolation_goes_through_the_poses_and_is_scipys():
    X, Y = linear_data()
    method = fitted("rbf", X, Y)
    np.testing.assert_allclose(method.predict(X).Y, Y, atol=1e-2)
    frames = linear_data(seed=1)[0]
    theirs = RBFInterpolator(X, Y, kernel="linear", degree=0, smoothing=SMOOTHING)
    np.testing.assert_allclose(method.predict(frames).Y, theirs(frames), atol=1e-10)


def test_packed_machines_predict_what_each_machine_predicts():
    X, Y = linear_data(noise=0.1)
    frames = linear_data(seed=1)[0]
    widths = np.array([0.01, 0.1])
    duals, offset = np.zeros((2, *Y.shape)), np.empty(4)
    expected = np.empty((len(frames), 4))
    for control in range(4):
        machine = ScikitSVR(gamma=widths[control % 2], C=10.0).fit(X, Y[:, control])
        duals[control % 2, machine.support_, control] = machine.dual_coef_[0]
        offset[control] = machine.intercept_[0]
        expected[:, control] = machine.predict(frames)
    packed = PackedMap(X, widths, duals, offset)
    np.testing.assert_allclose(packed(frames)[0], expected, atol=1e-10)


def test_support_vector_machines_follow_a_curve():
    angle = np.linspace(0.0, 6.0, 60)
    X, Y = angle[:, None] - 3.0, np.column_stack([np.sin(angle), np.abs(angle - 3.0)])
    predicted = fitted("svr", X[::2], Y[::2]).predict(X[1::2]).Y
    assert rms(predicted - Y[1::2]) < 0.1


def test_folds_are_runs_of_neighbours_and_cover_every_label_once():
    folds = blocked_folds(13)
    assert len(folds) == 5
    np.testing.assert_array_equal(np.concatenate([test for _, test in folds]), np.arange(13))
    for train, test in folds:
        assert (np.diff(test) == 1).all()
        assert not set(train) & set(test)
    assert len(blocked_folds(3)) == 3


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("ridge", {"map.weights": None}, "map.weights: expected an array of 2 dimensions"),
        ("ridge", {"map.offset": np.zeros(5)}, "map.offset: expected 4 for y, found shape"),
        ("ridge", {"map.weights": np.zeros((9, 4))}, "map.weights: expected 15 for x"),
        ("ridge", {"source.covariance": np.eye(9)}, "source.covariance: expected 15 for x"),
        ("ridge", {"source.covariance": -np.eye(15)}, "covariance: expected a positive definite"),
        ("gpr", {"source.response": None}, "source.response: expected an array of 2"),
        ("gpr", {"source.response": np.ones((15, 3))}, "source.response: expected 4 for y"),
        ("gpr", {"map.theta": np.ones(3)}, "map.theta: expected 4 for 4, found shape"),
        ("gpr", {"map.theta": -np.ones(4)}, "theta: expected positive numbers"),
        ("rbf", {"map.smoothing": np.ones(2)}, "map.smoothing"),
        ("nearest", {"map.X": np.zeros((0, 15))}, "map.X"),
        ("svr", {"map.inverse_widths": np.ones(9)}, "map.duals: expected 9 for g"),
    ],
)
def test_a_damaged_model_is_refused(name, change, message):
    method = fitted(name, *linear_data())
    arrays = {**method.save(), **change}
    arrays = {key: value for key, value in arrays.items() if value is not None}
    with pytest.raises(InputError, match=message):
        make_method(method.settings).load(arrays)


@pytest.mark.parametrize("name", ["ridge", "svr", "gpr", "nearest"])
def test_fewer_than_three_labels_are_refused(name):
    X, Y = linear_data()
    with pytest.raises(InputError, match=f"at least 3 posed frames for {name}, found 2"):
        fitted(name, X[:2], Y[:2])


def test_frames_and_poses_are_not_compared_all_at_once():
    rng = np.random.default_rng(0)
    X, poses = rng.normal(size=(20_000, 1)), rng.normal(size=(20_000, 2))
    frames = rng.normal(size=(3_000, 1))
    maps = [
        NearestMap(X, poses),
        PackedMap(X, np.array([1.0]), poses[None], np.zeros(2)),
    ]
    for map_ in maps:
        tracemalloc.start()
        found, _ = map_(frames)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 250e6  # all numbers of a kernel take 480 MB
        np.testing.assert_allclose(found[-5:], map_(frames[-5:])[0], rtol=1e-9)
        assert map_(frames[:0])[0].shape == (0, 2)
