import numpy as np
import pytest

from facert.errors import InputError
from facert.models import gaussian as model
from facert.models.gaussian import Gaussian, fill_gaps


def rows(n=300, d=9, rank=3, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, rank)) @ rng.normal(size=(rank, d)) + noise * rng.normal(size=(n, d))


def with_gaps(X, share, seed=1):
    gaps = np.random.default_rng(seed).random(X.shape) < share
    return np.where(gaps, np.nan, X), gaps


def test_complete_rows_are_handed_back():
    X = rows()
    assert fill_gaps(X) is X


def test_what_was_observed_is_never_changed():
    X, gaps = with_gaps(rows(noise=0.1), 0.3)
    filled = fill_gaps(X)
    np.testing.assert_array_equal(filled[~gaps], X[~gaps])
    assert np.isfinite(filled).all()
    assert np.isnan(X).any(), "the argument keeps its gaps"


def test_gaps_in_correlated_columns_are_filled_far_better_than_by_the_mean():
    truth = rows(noise=0.05)
    X, gaps = with_gaps(truth, 0.2)
    error = (fill_gaps(X) - truth)[gaps].std()
    assert error < 0.1 * (np.nanmean(X, axis=0) - truth)[gaps].std()


def test_columns_that_tell_nothing_of_each_other_are_filled_with_their_mean():
    X, gaps = with_gaps(np.random.default_rng(0).normal(size=(3000, 2)) + 5.0, 0.2)
    np.testing.assert_allclose(fill_gaps(X)[gaps], 5.0, atol=0.2)


def test_a_row_without_any_observation_gets_the_mean():
    X = rows(noise=0.1)
    X[3] = np.nan
    np.testing.assert_allclose(fill_gaps(X)[3], np.nanmean(X, axis=0), atol=0.02)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_unit_does_not_matter(scale):
    X, _ = with_gaps(rows(noise=0.1), 0.2)
    np.testing.assert_allclose(fill_gaps(scale * X), scale * fill_gaps(X), rtol=1e-6, atol=1e-9)


def conditional_mean(gaussian, row):
    """Of what one row hides, by the textbook."""
    h = np.isnan(row)
    gain = np.linalg.solve(gaussian.covariance[np.ix_(~h, ~h)], (row - gaussian.mean)[~h])
    return gaussian.mean[h] + gaussian.covariance[np.ix_(h, ~h)] @ gain


@pytest.mark.parametrize("chunk", [1, 500, model.CHUNK])
def test_new_frames_are_filled_by_the_conditional_mean_whatever_each_hides(chunk, monkeypatch):
    monkeypatch.setattr(model, "CHUNK", chunk)
    gaussian = Gaussian.of(rows(noise=0.1))
    X, _ = with_gaps(rows(n=50, noise=0.1, seed=2), 0.4)
    X[7], X[8] = np.nan, 0.0
    filled = gaussian.fill(X)
    for row, result in zip(X, filled, strict=True):
        np.testing.assert_allclose(result[np.isnan(row)], conditional_mean(gaussian, row))
        np.testing.assert_array_equal(result[~np.isnan(row)], row[~np.isnan(row)])
    np.testing.assert_allclose(filled[7], gaussian.mean)


def test_a_gaussian_of_complete_rows_has_their_moments():
    X = rows(noise=0.1)
    gaussian = Gaussian.of(X)
    np.testing.assert_allclose(gaussian.mean, X.mean(axis=0))
    np.testing.assert_allclose(gaussian.covariance, np.cov(X.T, bias=True), atol=1e-4)


def test_fitted_through_gaps_a_gaussian_keeps_the_variance_that_filling_takes_away():
    X = rows(n=2000, noise=1.0)
    gappy, _ = with_gaps(X, 0.3)
    plain = np.cov(fill_gaps(gappy).T, bias=True).trace()
    whole, fitted = np.cov(X.T, bias=True).trace(), np.trace(Gaussian.of(gappy).covariance)
    assert abs(fitted - whole) < 0.3 * abs(plain - whole)


@pytest.mark.parametrize("chunk", [1, 500, model.CHUNK])
def test_what_a_fill_leaves_open_of_a_linear_function_is_its_conditional_variance(
    chunk, monkeypatch
):
    monkeypatch.setattr(model, "CHUNK", chunk)
    gaussian = Gaussian.of(rows(noise=0.1))
    X, _ = with_gaps(rows(n=50, noise=0.1, seed=2), 0.4)
    X[7], X[8] = np.nan, 0.0
    B = np.random.default_rng(3).normal(size=(9, 4))
    filled, variance = gaussian.fill_for(X, B)

    np.testing.assert_allclose(filled, gaussian.fill(X), rtol=1e-10, atol=1e-10)
    for h, found in zip(np.isnan(X), variance, strict=True):
        S = gaussian.covariance
        gain = np.linalg.solve(S[np.ix_(~h, ~h)], S[np.ix_(~h, h)])
        left = S[np.ix_(h, h)] - S[np.ix_(h, ~h)] @ gain
        np.testing.assert_allclose(found, np.diag(B[h].T @ left @ B[h]), rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(variance[7], np.diag(B.T @ gaussian.covariance @ B))
    assert not variance[8].any()


def test_a_covariance_that_would_fill_the_memory_is_refused():
    with pytest.raises(InputError, match=r"/source \(60000\): expected at most .* of memory"):
        Gaussian.of(np.zeros((2, 60_000)))
