"""The two layers of motion: what is learned of processes that are known, and their sum."""

import numpy as np
import pytest

from facert.preprocess.motion import motion as room
from facert.preprocess.motion.motion import Motion, _Residuals, _rest
from facert.preprocess.motion.smoothing import smooth_factors, smooth_series, transition

SIGMA = 0.2


def processes(frames, count, rate, rng):
    """Matérn processes of unit variance at a rate, (T, count)."""
    F = transition(np.full(1, rate))[:, :, 0]
    noise = np.linalg.cholesky(np.eye(2) - F @ F.T + 1e-12 * np.eye(2))
    state, found = rng.normal(size=(2, count)), np.empty((frames, count))
    for t in range(frames):
        found[t] = state[0]
        state = F @ state + noise @ rng.normal(size=(2, count))
    return found


@pytest.mark.parametrize("rate", [0.3, 1.0])
def test_variance_and_rate_of_a_residual_are_found_through_capture_noise(rate):
    rng = np.random.default_rng(0)
    left = 0.5 * processes(40, 2000, rate, rng).reshape(40, 500, 4)
    left += 0.3 * rng.normal(size=left.shape)
    left[rng.random(left.shape) < 0.1] = np.nan
    variance, rates = _rest(_Residuals.of([left]), np.ones(1), 0.3)
    np.testing.assert_allclose(variance, 0.5**2, rtol=0.15)
    np.testing.assert_allclose(rates, rate, rtol=0.15)


@pytest.fixture(scope="module")
def taken():
    """Frames of three slow factors and quick rests, with capture noise and gaps; their motion."""
    rng = np.random.default_rng(0)
    X = processes(200, 3, 0.1, rng) @ rng.normal(size=(3, 12)) / np.sqrt(3)
    X += 0.3 * processes(200, 12, 0.5, rng) + SIGMA * rng.normal(size=X.shape)
    X[rng.random(X.shape) < 0.1] = np.nan
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(room, "FACTORS", 3)
        return X, Motion.learned(X, SIGMA)


def test_the_noise_of_the_factors_is_what_a_column_has_of_its_own(taken):
    """Without the capture noise, which is put back where frames are seen."""
    _, motion = taken
    np.testing.assert_allclose(np.median(motion.factors.noise), 0.3**2, rtol=0.15)
    np.testing.assert_allclose(motion.seen_with(0.7).noise, motion.factors.noise + 0.7**2)


def test_a_smoothed_frame_is_its_factors_and_the_smoothed_rest_of_each_column(taken):
    X, motion = taken
    seen, factors = ~np.isnan(X), motion.seen_with(SIGMA)
    found = smooth_factors(*factors.information(X), motion.rates)
    shared = motion.factors.mean + found.mean @ motion.factors.weights.T
    rest, left = smooth_series(X - shared, seen, motion.rest, SIGMA**2, motion.rest_rates)
    mean, variance = motion.smooth(X, SIGMA)
    np.testing.assert_allclose(mean, shared + rest, atol=1e-10)
    W = motion.factors.weights
    own = np.array([np.diag(W @ C @ W.T) for C in found.covariance]) + left
    np.testing.assert_allclose(variance[~seen], own[~seen], atol=1e-10)
    # Two layers take each other for noise: what was seen is known at least as well as it was shown.
    np.testing.assert_allclose(variance[seen], np.minimum(own, SIGMA**2)[seen], atol=1e-10)


@pytest.mark.parametrize("rate", [0.7, 1.5])
def test_how_quickly_factors_move_is_found(rate, monkeypatch):
    monkeypatch.setattr(room, "FACTORS", 2)
    rng = np.random.default_rng(0)
    X = processes(600, 2, rate, rng) @ rng.normal(size=(2, 12))
    X += SIGMA * rng.normal(size=X.shape)
    np.testing.assert_allclose(Motion.learned(X, SIGMA).rates, rate, rtol=0.3)
