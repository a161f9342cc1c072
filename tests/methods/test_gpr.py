import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

from facert.errors import InputError
from facert.methods.base import Labelled, Unlabelled
from facert.methods.gpr import ProcessMap
from facert.methods.registry import make_method
from facert.settings import Settings


def frames_and_poses(n=20, noise=0.05, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, 6))
    return X, np.sin(X @ rng.normal(size=(6, 3)) / 2.0) + noise * rng.normal(size=(n, 3))


@pytest.mark.parametrize("theta", [(1.5, 0.3, 50.0, 0.0), (0.5, 2.0, 1e4, 0.2)])
def test_predictions_equal_scikit_learns_at_equal_hyperparameters(theta):
    X, Y = frames_and_poses()
    frames = np.random.default_rng(1).normal(size=(40, 6))
    theta1, theta2, theta3, theta4 = theta
    kernel = ConstantKernel(theta1) * RBF(theta2**-0.5) + WhiteKernel(1.0 / theta3)
    if theta4:
        kernel += ConstantKernel(theta4) * DotProduct(0.0, "fixed")
    theirs = GaussianProcessRegressor(kernel, optimizer=None, alpha=0.0).fit(X, Y)
    expected_mean, expected_std = theirs.predict(frames, return_std=True)

    mean, variance = ProcessMap(X, Y, np.array(theta))(frames)
    np.testing.assert_allclose(mean, expected_mean, atol=1e-8)
    np.testing.assert_allclose(np.sqrt(variance()), expected_std, atol=1e-8)


@pytest.mark.parametrize("name", ["gpr", "gpr-linear"])
def test_far_from_the_labels_the_std_grows(name):
    X, Y = frames_and_poses()
    method = make_method(Settings(method=name))
    method.fit(Labelled(X, Y), Unlabelled(X[:0], Y[:0]))
    near, far = method.predict(X), method.predict(10.0 * X)
    assert (far.std > near.std).all()
    assert near.std.shape == Y.shape


def test_the_papers_baseline_has_the_squared_exponential_alone():
    """Where a linear term would explain all: its poses are those of Eq. (3) at the θ it found."""
    rng = np.random.default_rng(0)
    X = rng.normal(size=(20, 6))
    Y = X @ rng.normal(size=(6, 3)) + 0.05 * rng.normal(size=(20, 3))
    method = make_method(Settings(method="gpr"))
    report = method.fit(Labelled(X, Y), Unlabelled(X[:0], Y[:0]))
    theta1, theta2, theta3 = (report.figures[f"theta{i}"] for i in (1, 2, 3))
    frames = 10.0 * rng.normal(size=(30, 6))

    def k(A, B):
        return theta1 * np.exp(-theta2 / 2 * np.sum((A[:, None] - B) ** 2, axis=2))

    expected = k(frames, X) @ np.linalg.solve(k(X, X) + np.eye(20) / theta3, Y)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(method.predict(frames).Y, expected, atol=1e-6 * scale)
    assert np.abs(method.predict(1e4 * frames).Y).max() < 1e-6 * scale


@pytest.mark.parametrize("theta", [(1.0, 0.0, 1.0, 0.0), (1.0, 1.0, 0.0, 0.0), (1, 1, 1, -1)])
def test_kernel_parameters_that_make_no_kernel_are_refused(theta):
    X, Y = frames_and_poses()
    with pytest.raises(InputError, match="theta: expected positive numbers"):
        ProcessMap(X, Y, np.array(theta, dtype=float))


def test_leave_one_out_errors_are_those_of_refitting():
    X, Y = frames_and_poses()
    theta = np.array([0.5, 2.0, 50.0, 0.2])
    errors = ProcessMap(X, Y, theta).leave_one_out_errors
    for left_out in range(len(X)):
        others = np.arange(len(X)) != left_out
        mean, _ = ProcessMap(X[others], Y[others], theta)(X[left_out : left_out + 1])
        np.testing.assert_allclose(errors[left_out], Y[left_out] - mean[0], atol=1e-10)
