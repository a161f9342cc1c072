import numpy as np
import pytest
from scipy.linalg import solve_triangular

from facert.errors import NumericalError
from facert.models.gp.jitter import LARGE, SMALL, inverted, lower_factor, whitener


def positive(points, seed=0):
    A = np.random.default_rng(seed).normal(size=(points, points + 3))
    return A @ A.T / points + 0.1 * np.eye(points)


@pytest.mark.parametrize("points", [1, 2, SMALL, SMALL + 1, 2 * SMALL + 3, LARGE])
def test_triangles_of_any_size_are_inverted(points):
    L = np.linalg.cholesky(positive(points))
    expected = solve_triangular(L, np.eye(points), lower=True)
    np.testing.assert_allclose(np.tril(inverted(L)), expected, rtol=1e-9, atol=1e-12)


def test_what_stands_above_the_diagonal_is_not_read():
    L = np.linalg.cholesky(positive(150))
    other = L + np.triu(np.ones_like(L), 1)
    np.testing.assert_array_equal(np.tril(inverted(other)), np.tril(inverted(L.copy())))


def test_a_whitened_kernel_is_the_identity():
    K = positive(200)
    T = whitener(K)
    np.testing.assert_allclose(T @ K @ T.T, np.eye(200), atol=1e-10)
    np.testing.assert_array_equal(T, np.tril(T))


def test_numbers_that_are_none_are_not_taken_for_a_lack_of_jitter():
    for wrong in (np.nan, np.inf):
        K = positive(4)
        K[2, 2] = wrong
        with pytest.raises(NumericalError, match="NaN or infinity"):
            lower_factor(K)
