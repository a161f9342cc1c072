"""A step of expectation maximisation for factors seen through gaps, against its equations."""

import numpy as np
import pytest

from facert.preprocess.motion import motion_factors
from facert.preprocess.motion.motion_factors import MotionFactors, _maximised, _Shown

FRAMES, COLUMNS, FACTORS = 40, 6, 2
TINY = 1e-6


@pytest.fixture
def start():
    rng = np.random.default_rng(0)
    weights, noise = rng.normal(size=(COLUMNS, FACTORS)), rng.uniform(0.1, 0.5, COLUMNS)
    return MotionFactors(rng.normal(size=COLUMNS), weights, noise)


def frames(share=0.3, seed=1):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(FRAMES, 3)) @ rng.normal(size=(3, COLUMNS)) + rng.normal(size=COLUMNS)
    X += 0.3 * rng.normal(size=X.shape)
    return np.where(rng.random(X.shape) < share, np.nan, X)


def stepped(factors, X):
    """The factors after one step."""
    return _maximised(_Shown.by(X), *factors.posterior(X), TINY)


def expected_factors(factors, x):
    """Mean and covariance of z given what a frame shows: conditioning of a joint Gaussian."""
    s = ~np.isnan(x)
    W, covariance = factors.weights[s], factors.weights[s] @ factors.weights[s].T
    gain = np.linalg.solve(covariance + np.diag(factors.noise[s]), W).T
    return gain @ (x - factors.mean)[s], np.eye(FACTORS) - gain @ W


def log_likelihood(factors, X):
    """Of what the frames show."""
    total = 0.0
    for x in X:
        s = ~np.isnan(x)
        W, away = factors.weights[s], (x - factors.mean)[s]
        covariance = W @ W.T + np.diag(factors.noise[s])
        total -= 0.5 * np.linalg.slogdet(2.0 * np.pi * covariance)[1]
        total -= 0.5 * away @ np.linalg.solve(covariance, away)
    return total


def test_the_posterior_of_factors_is_that_of_conditioning_on_what_a_frame_shows(start):
    X = frames()
    mean, covariance = start.posterior(X)
    for row, x in enumerate(X):
        expected = expected_factors(start, x)
        np.testing.assert_allclose(mean[row], expected[0], atol=1e-10)
        np.testing.assert_allclose(covariance[row], expected[1], atol=1e-10)


def test_each_column_is_a_regression_on_the_frames_that_show_it_with_one_frame_of_prior(start):
    """The prior draws the weights to zero, and not the mean."""
    X, found = frames(), stepped(start, frames())
    known = [expected_factors(start, x) for x in X]
    square = np.mean([np.outer(z, z) + C for z, C in known], axis=0)
    for d in range(COLUMNS):
        A, b = np.diag([1.0] * FACTORS + [0.0]), np.zeros(FACTORS + 1)
        shown = [(x[d], *both) for x, both in zip(X, known, strict=True) if not np.isnan(x[d])]
        for value, z, C in shown:
            A += np.outer(np.r_[z, 1.0], np.r_[z, 1.0])
            A[:FACTORS, :FACTORS] += C
            b += value * np.r_[z, 1.0]
        row = np.linalg.solve(A, b)
        w, mean = row[:-1], row[-1]
        missed = [(value - z @ w - mean) ** 2 + w @ C @ w for value, z, C in shown]
        assert found.mean[d] == pytest.approx(mean)
        assert found.noise[d] == pytest.approx(np.mean(missed))
        assert found.weights[d] @ found.weights[d] == pytest.approx(w @ square @ w)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_without_a_prior_no_step_lowers_the_likelihood_of_what_was_seen(start, share, monkeypatch):
    monkeypatch.setattr(motion_factors, "ONCE_MORE", 0.0)
    X, factors = frames(share), start
    curve = [log_likelihood(factors, X)]
    for _ in range(12):
        factors = stepped(factors, X)
        curve.append(log_likelihood(factors, X))
    assert (np.diff(curve) > -1e-8).all()
    assert curve[-1] > curve[0] + 10.0


def test_the_search_goes_far_enough_that_another_step_changes_little():
    X = frames()
    filled = np.where(np.isnan(X), np.nanmean(X, axis=0), X)
    found = MotionFactors.learned(X, filled, 0.1, FACTORS)
    before = found.weights @ found.weights.T
    again = stepped(found, X)
    assert np.abs(again.weights @ again.weights.T - before).max() < 0.05 * np.abs(before).max()


def test_factors_of_many_columns_are_learned_from_some_and_the_weights_of_all_follow(monkeypatch):
    rng = np.random.default_rng(3)
    X = rng.normal(size=(60, 3)) @ rng.normal(size=(3, 40)) + 0.01 * rng.normal(size=(60, 40))
    plain = MotionFactors.learned(X, X, 0.01, 3)
    monkeypatch.setattr(motion_factors, "PART", 10)
    from_some = MotionFactors.learned(X, X[:, motion_factors.part_of(40)], 0.01, 3)
    same = plain.weights @ plain.weights.T
    np.testing.assert_allclose(from_some.weights @ from_some.weights.T, same, atol=0.01)
    np.testing.assert_allclose(from_some.noise, plain.noise, rtol=1.0)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.6])
def test_sums_over_what_is_seen_are_the_same_however_little_is_hidden(share):
    rng = np.random.default_rng(0)
    hidden = rng.random((30, 50)) < share
    shown = _Shown.by(np.where(hidden, np.nan, 1.0))
    for axis, seen in ((1, ~hidden), (0, ~hidden.T)):
        values = rng.normal(size=(seen.shape[1], 4))
        np.testing.assert_allclose(shown.sums(values, axis), seen @ values, atol=1e-12)
