import numpy as np
import pytest
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from facert.models.kernels import Kernel, initial_log_kernel

KERNEL = Kernel(variance=1.7, inverse_width=0.6, noise=0.03)
SKLEARN = ConstantKernel(1.7) * RBF(0.6**-0.5) + WhiteKernel(0.03)


@pytest.fixture
def Z():
    return np.random.default_rng(0).normal(size=(12, 3))


def test_the_training_matrix_equals_scikit_learns(Z):
    np.testing.assert_allclose(KERNEL.gram(Z), SKLEARN(Z), rtol=1e-12)


def test_between_two_sets_there_is_no_noise_even_where_points_agree(Z):
    np.testing.assert_allclose(KERNEL.cross(Z[:4], Z), SKLEARN(Z[:4], Z), rtol=1e-12)
    assert KERNEL.cross(Z, Z).diagonal() == pytest.approx(KERNEL.variance)


def test_training_begins_at_the_papers_parameters():
    assert Kernel.from_log(initial_log_kernel(), 0.0).theta == pytest.approx((1.0, 1.0, 100.0))


def test_the_noise_never_falls_below_its_floor():
    log_kernel = initial_log_kernel()
    log_kernel[2] = -1000.0
    assert Kernel.from_log(log_kernel, 0.05).noise == 0.05
