"""Leave-one-out errors in closed form are those of refitting without each row."""

import numpy as np
import pytest

from facert.models.loo import KernelRidge, LinearRidge

PENALTIES = (1e-6, 1e-2, 3.0)


def data(n, d, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, d)), rng.normal(size=(n, 3))


def refitted(K, Y, penalty):
    """Errors of fits to all rows but one."""
    errors = np.empty_like(Y)
    for row in range(len(Y)):
        rest = np.delete(np.arange(len(Y)), row)
        system = K[np.ix_(rest, rest)] + penalty * np.eye(len(rest))
        errors[row] = Y[row] - K[row, rest] @ np.linalg.solve(system, Y[rest])
    return errors


@pytest.mark.parametrize("penalty", PENALTIES)
def test_any_kernel(penalty):
    X, Y = data(12, 4)
    K = np.exp(-np.sum((X[:, None] - X) ** 2, axis=2)) + 0.5
    ridge = KernelRidge.of(K, Y)
    solved = np.linalg.solve(K + penalty * np.eye(12), Y)
    np.testing.assert_allclose(ridge.weights(penalty), solved, rtol=1e-6)
    np.testing.assert_allclose(ridge.errors(penalty), refitted(K, Y, penalty), rtol=1e-6)


@pytest.mark.parametrize("penalty", PENALTIES)
@pytest.mark.parametrize(("n", "d"), [(12, 4), (12, 30), (7, 7)])
def test_linear_regression_with_more_rows_or_more_columns(n, d, penalty):
    X, Y = data(n, d)
    ridge = LinearRidge.of_inputs(X, Y)
    slopes = np.linalg.solve(X.T @ X + penalty * np.eye(d), X.T @ Y)
    np.testing.assert_allclose(ridge.slopes(penalty), slopes, rtol=1e-6, atol=1e-9)
    errors = np.empty_like(Y)
    for row in range(n):
        rest = np.delete(np.arange(n), row)
        gram = X[rest].T @ X[rest] + penalty * np.eye(d)
        errors[row] = Y[row] - X[row] @ np.linalg.solve(gram, X[rest].T @ Y[rest])
    np.testing.assert_allclose(ridge.errors(penalty), errors, rtol=1e-5, atol=1e-8)


def test_each_column_may_have_its_own_penalty():
    X, Y = data(9, 5)
    ridge, penalties = LinearRidge.of_inputs(X, Y), np.array(PENALTIES)
    for column, penalty in enumerate(penalties):
        for fit in (ridge.weights, ridge.slopes):
            np.testing.assert_allclose(fit(penalties)[:, column], fit(penalty)[:, column])


def test_several_regressions_at_once_are_each_its_own():
    inputs = [data(8, 3, seed) for seed in range(4)]
    kernels = np.array([X @ X.T for X, _ in inputs])
    several = KernelRidge.of(kernels, np.array([Y for _, Y in inputs])).errors(0.1)
    for K, (_, Y), errors in zip(kernels, inputs, several, strict=True):
        np.testing.assert_allclose(errors, KernelRidge.of(K, Y).errors(0.1), atol=1e-12)
