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


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("lack", "least"), [(0.0, 0.0), (3e-11, 1e-10), (3e-9, 1e-8)])
def test_no_more_jitter_is_added_than_a_matrix_lacks_whatever_its_unit(scale, lack, least):
    """By factors of a hundred, relative to the mean of the diagonal."""
    directions, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(8, 8)))
    values = np.array([2.0, 2.0, 1.0, 1.0, 1.0, 0.5, 0.5, 1e-3])
    values[-1] = -lack if lack else values[-1]
    K = scale * (directions * values) @ directions.T
    K = (K + K.T) / 2.0
    L = np.tril(lower_factor(K))
    added = np.diag(L @ L.T - K) / K.diagonal().mean()
    np.testing.assert_allclose(added, least, rtol=0.1, atol=1e-14)
