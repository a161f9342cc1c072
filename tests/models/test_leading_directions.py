"""A dense source by its leading directions: what they keep, and what they fill in."""

import numpy as np
import pytest
from sklearn.decomposition import PCA

from facert.models.gaussian import Gaussian
from facert.models.leading_directions import RANK, LeadingDirections, principal_variances


def frames(count=60, columns=400, rank=5, noise=0.01, seed=0):
    rng = np.random.default_rng(seed)
    shown = rng.normal(size=(count, rank)) * np.geomspace(3.0, 0.3, rank)
    return shown @ rng.normal(size=(rank, columns)) + noise * rng.normal(size=(count, columns))


@pytest.mark.parametrize("shape", [(60, 400), (500, 40), (300, 400)], ids=["wide", "long", "both"])
def test_directions_are_the_principal_ones(shape):
    X = frames(*shape)
    found, reference = LeadingDirections.learned(X), PCA(5).fit(X)
    ratio = reference.explained_variance_ * (len(X) - 1) / len(X)
    np.testing.assert_allclose(found.variances[:5], ratio, rtol=1e-9)
    alike = np.abs(np.sum(found.basis[:, :5] * reference.components_.T, axis=0))
    np.testing.assert_allclose(alike, 1.0, atol=1e-9)
    left = np.square(X - X.mean(axis=0)).sum() / len(X) - found.variances.sum()
    columns = max(shape[1] - found.basis.shape[1], 1)
    total = np.square(X - X.mean(axis=0)).mean()
    np.testing.assert_allclose(found.noise, max(left / columns, 1e-6 * total), rtol=1e-6)
    r = found.basis.shape[1]
    assert r == min(RANK, shape[1])
    np.testing.assert_allclose(found.basis.T @ found.basis, np.eye(r), atol=1e-12)


def test_distances_between_scores_are_those_between_frames():
    X = frames()
    S = LeadingDirections.learned(X).scores(X)
    np.testing.assert_allclose(S @ S.T, (X - X.mean(0)) @ (X - X.mean(0)).T, atol=1e-9)


def test_a_gap_is_filled_as_the_gaussian_of_the_same_covariance_does():
    X = frames(noise=0.05)
    found = LeadingDirections.learned(X)
    C = found.basis * found.variances @ found.basis.T + found.noise * np.eye(X.shape[1])
    gaps = X.copy()
    gaps[3, :150] = gaps[4, :150] = gaps[7, 100:390] = np.nan
    filled, variance = found.fill(gaps)
    same, own = Gaussian(found.mean, C).fill_for(gaps, found.basis)
    np.testing.assert_allclose(filled, same, atol=1e-6)
    np.testing.assert_allclose(variance, own, rtol=1e-6, atol=1e-12)
    assert np.abs(filled - X).max() < 0.3
    shown = ~np.isnan(gaps)
    assert np.array_equal(filled[shown], gaps[shown])


def test_a_complete_frame_is_not_copied():
    X = frames()
    filled, variance = LeadingDirections.learned(X).fill(X)
    assert filled is X
    assert variance is None


def test_a_frame_of_which_nothing_is_seen_is_the_mean():
    X = frames()
    found = LeadingDirections.learned(X)
    filled, variance = found.fill(np.full((1, X.shape[1]), np.nan))
    np.testing.assert_allclose(filled[0], found.mean, atol=1e-12)
    np.testing.assert_allclose(variance[0], found.variances + found.noise, rtol=1e-6)


def test_directions_are_learned_through_gaps():
    X = frames(count=80, noise=0.01)
    gaps = X.copy()
    gaps[np.random.default_rng(1).random(X.shape) < 0.1] = np.nan
    filled, _ = LeadingDirections.learned(gaps).fill(gaps)
    assert np.sqrt(np.mean((filled - X)[np.isnan(gaps)] ** 2)) < 0.05


def test_few_frames_leave_directions_without_variance():
    found = LeadingDirections.learned(frames(count=4))
    assert found.basis.shape == (400, RANK)
    np.testing.assert_allclose(found.basis.T @ found.basis, np.eye(RANK), atol=1e-12)
    assert not found.variances[4:].any()
    assert np.isfinite(found.fill(np.full((2, 400), np.nan))[1]).all()


@pytest.mark.parametrize("shape", [(60, 400), (500, 40)], ids=["wide", "long"])
def test_principal_variances_are_those_of_a_decomposition(shape):
    X = frames(*shape)
    expected = np.linalg.svd(X - X.mean(axis=0), compute_uv=False) ** 2 / len(X)
    np.testing.assert_allclose(principal_variances(X), expected, atol=1e-10)
