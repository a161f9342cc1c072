"""Every kernel of the registry, and the paper's against another library's."""

import numpy as np
import pytest
import torch
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel
from torch.func import jvp

from facert.errors import InputError
from facert.models.kernels import (
    KERNELS,
    RegressionKernel,
    SquaredExponential,
    initial_log_kernel,
    kernel_class,
)
from facert.settings import DESCRIBED

THETA = {"variance": 1.7, "inverse_width": 0.6, "noise": 0.03}
KERNEL = SquaredExponential(**THETA)
SHAPES = {"squared-exponential": RBF(0.6**-0.5), "matern-5/2": Matern(0.6**-0.5, nu=2.5)}


@pytest.fixture
def Z():
    return np.random.default_rng(0).normal(size=(12, 3))


@pytest.fixture(params=KERNELS)
def kernel(request):
    return KERNELS[request.param](**THETA)


@pytest.mark.parametrize("name", SHAPES)
def test_the_training_matrix_equals_scikit_learns(Z, name):
    theirs = ConstantKernel(1.7) * SHAPES[name] + WhiteKernel(0.03)
    np.testing.assert_allclose(KERNELS[name](**THETA).gram(Z), theirs(Z), rtol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_between_two_sets_there_is_no_noise_even_where_points_agree(Z, name):
    kernel, theirs = KERNELS[name](**THETA), ConstantKernel(1.7) * SHAPES[name]
    np.testing.assert_allclose(kernel.cross(Z[:4], Z), theirs(Z[:4], Z), rtol=1e-12)
    assert kernel.cross(Z, Z).diagonal() == pytest.approx(kernel.variance)


def test_at_distance_zero_a_kernel_is_its_variance(kernel):
    assert kernel.value(np.zeros(1))[0] == kernel.variance


def test_the_training_matrix_is_symmetric_and_positive_definite(kernel, Z):
    K = kernel.gram(np.vstack([Z, Z]))
    np.testing.assert_allclose(K, K.T, rtol=1e-12)
    assert np.linalg.eigvalsh(K)[0] > 0.99 * kernel.noise


def derivatives(kernel, s):
    """Value, slope and curvature by differentiating the value."""

    def slope(s):
        return jvp(kernel.value, (s,), (torch.ones_like(s),))[1]

    return kernel.value(s), *jvp(slope, (s,), (torch.ones_like(s),))


@pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")  # of torch itself
def test_slope_and_curvature_are_those_of_the_value_by_differentiation(kernel):
    s = torch.from_numpy(np.random.default_rng(1).uniform(0.0, 30.0, size=(4, 5)))
    k, slope, curvature = derivatives(kernel, s)
    torch.testing.assert_close(k * kernel.relative_slope(s), slope, rtol=1e-12, atol=0.0)
    torch.testing.assert_close(k * kernel.relative_curvature(s), curvature, rtol=1e-12, atol=0.0)


FUNCTIONS = ("value", "relative_slope", "relative_curvature")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_arrays_and_tensors_give_the_same_and_stay_as_they_were(kernel, name):
    s = np.random.default_rng(1).uniform(0.0, 30.0, size=(4, 5))
    before, function = s.copy(), getattr(kernel, name)
    np.testing.assert_allclose(function(torch.from_numpy(s)), function(s), rtol=1e-14)
    np.testing.assert_array_equal(s, before)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_it_is_finite_where_points_agree_and_far_away(kernel, name):
    assert np.isfinite(getattr(kernel, name)(np.array([-1e-16, 0.0, 1e-300, 1e6]))).all()


def test_the_linear_term_of_regression_adds_the_products(Z):
    kernel = RegressionKernel(**THETA, linear=0.4)
    np.testing.assert_allclose(kernel.gram(Z), KERNEL.gram(Z) + 0.4 * Z @ Z.T, rtol=1e-12)


def test_an_unknown_kernel_is_refused():
    with pytest.raises(InputError, match=r"source_kernel: expected one of .*matern.*'cubic'"):
        kernel_class("cubic", "source_kernel")


def test_training_begins_at_the_papers_parameters(kernel):
    assert type(kernel).from_log(initial_log_kernel(), 0.0).theta == pytest.approx((1, 1, 100))


def test_the_noise_never_falls_below_its_floor(kernel):
    log_kernel = initial_log_kernel()
    log_kernel[2] = -1000.0
    assert type(kernel).from_log(log_kernel, 0.05).noise == 0.05


def test_the_noise_is_the_floor_and_what_is_above_it(kernel):
    """And so it stays when training begins at a trained kernel."""
    log_kernel = np.log([1.2, 0.4, 0.02])
    made = type(kernel).from_log(log_kernel, 0.05)
    assert made.noise == pytest.approx(0.07)
    np.testing.assert_allclose(made.to_log(0.05), log_kernel)
    at_floor = type(kernel)(1.2, 0.4, 0.05).to_log(0.05)
    assert type(kernel).from_log(at_floor, 0.05).noise == pytest.approx(0.05, rel=0.01)


def test_the_help_names_every_kernel():
    _, about = DESCRIBED["source_kernel"]
    assert all(name in about.help for name in KERNELS)
