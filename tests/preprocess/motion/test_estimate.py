import numpy as np
import pytest
from scipy.linalg import block_diag

from facert.errors import InputError
from facert.io.formats import read_take_file
from facert.models.gaussian import fill_gaps
from facert.preprocess.motion import smoothing
from facert.preprocess.motion.estimate import estimate, estimate_if_it_moves
from facert.preprocess.motion.motion_factors import MotionFactors
from facert.preprocess.motion.series import (
    LONGEST,
    capture_noise,
    even_grid,
    interpolated,
    largest_step,
)
from facert.preprocess.motion.smoothing import decay, smooth_factors, smooth_series, transition


def estimated(X, sigma=None):
    return estimate(X, np.arange(len(X)) / 30.0, sigma)


def rms(values):
    return np.sqrt(np.mean(values**2))


@pytest.fixture(scope="module")
def frames(face):
    return face.reshape(len(face), -1)


def with_gaps(X, share=0.2, seed=0):
    hidden = np.random.default_rng(seed).random((len(X), X.shape[1] // 3)) < share
    return np.where(np.repeat(hidden, 3, axis=1), np.nan, X)


def with_bursts(X, seed=0):
    rng, result = np.random.default_rng(seed), X.copy()
    for marker in range(8, X.shape[1] // 3):
        start = rng.integers(len(X) - 60)
        result[start : start + 60, 3 * marker : 3 * marker + 3] = np.nan
    return result


def kernel(steps, a):
    lag = np.abs(steps[:, None] - steps) * a
    return (1.0 + lag) * np.exp(-lag)


def test_decay_and_transition_are_those_of_the_matern_kernel():
    a = np.array([0.05, 0.4, 2.0])
    np.testing.assert_allclose(decay((1.0 + a) * np.exp(-a)), a)
    F, lags = transition(a), np.arange(6.0)
    for k in range(3):
        powers = [np.linalg.matrix_power(F[:, :, k], n)[0, 0] for n in range(6)]
        np.testing.assert_allclose(powers, kernel(lags, a[k])[0])
    assert np.isfinite(decay(np.array([-1.0, 0.0, 1.0, 2.0]))).all()


def test_smoothing_factors_is_regression_with_their_kernels():
    rng, a = np.random.default_rng(0), np.array([0.2, 0.7])
    steps, W = np.arange(15), rng.normal(size=(4, 2))
    precision = np.stack([W.T @ np.diag(seen) @ W for seen in rng.random((15, 4)) < 0.6])
    pull = rng.normal(size=(15, 2))
    found = smooth_factors(precision, pull, a)

    prior = np.zeros((15, 2, 15, 2))
    prior[:, 0, :, 0], prior[:, 1, :, 1] = kernel(steps, a[0]), kernel(steps, a[1])
    posterior = np.linalg.inv(np.linalg.inv(prior.reshape(30, 30)) + block_diag(*precision))
    np.testing.assert_allclose(found.mean.ravel(), posterior @ pull.ravel(), atol=1e-8)
    blocks = posterior.reshape(15, 2, 15, 2)
    mean = found.mean
    for t in range(15):
        np.testing.assert_allclose(found.covariance[t], blocks[t, :, t], atol=1e-8)
        if t < 14:
            lagged = np.diag(blocks[t, :, t + 1]) + mean[t] * mean[t + 1]
            np.testing.assert_allclose(found.following[t], lagged, atol=1e-8)


def test_many_stretches_at_once_are_smoothed_each_on_its_own():
    rng, a = np.random.default_rng(1), np.array([0.2, 0.7])
    W = rng.normal(size=(10, 3, 4, 2))
    precision, pull = W.swapaxes(-1, -2) @ W, rng.normal(size=(10, 3, 2))
    together = smooth_factors(precision, pull, a)
    for b in range(3):
        alone = smooth_factors(precision[:, b], pull[:, b], a)
        np.testing.assert_allclose(together.mean[:, b], alone.mean, atol=1e-12)
        np.testing.assert_allclose(together.covariance[:, b], alone.covariance, atol=1e-12)


def test_smoothing_series_is_regression_of_each():
    rng, steps = np.random.default_rng(2), np.arange(20)
    X, seen = rng.normal(size=(20, 3)), rng.random((20, 3)) < 0.6
    variance, a, noise = np.array([0.5, 1.0, 4.0]), np.array([0.1, 0.5, 3.0]), 0.3
    mean, left = smooth_series(np.where(seen, X, np.nan), seen, variance, noise, a)
    for j in range(3):
        prior, s = variance[j] * kernel(steps, a[j]), seen[:, j]
        gain = np.linalg.solve(prior[np.ix_(s, s)] + noise * np.eye(s.sum()), prior[s]).T
        np.testing.assert_allclose(mean[:, j], gain @ X[s, j], atol=1e-8)
        np.testing.assert_allclose(left[:, j], np.diag(prior - gain @ prior[s]), atol=1e-8)


def with_a_gap(frames=120):
    """Which of three columns is seen: all, but for one that is hidden for a while."""
    seen = np.ones((frames, 3), dtype=bool)
    seen[50:70, 1] = False
    return seen


def test_covariances_that_have_settled_are_computed_no_more_and_nothing_changes(monkeypatch):
    rng, a = np.random.default_rng(4), np.array([0.1, 0.7])
    W, seen = rng.normal(size=(3, 2)), with_a_gap()
    precision = np.stack([W.T @ np.diag(100.0 * there) @ W for there in seen])
    factors = precision, 100.0 * rng.normal(size=(120, 2)), a
    series = rng.normal(size=(120, 3)), seen, np.array([0.5, 1.0, 4.0]), 0.3, np.r_[a, 3.0]
    quick, quick_series = smooth_factors(*factors), smooth_series(*series)
    monkeypatch.setattr(smoothing, "SETTLED", -1.0)
    whole, whole_series = smooth_factors(*factors), smooth_series(*series)
    for name in ("mean", "covariance", "following"):
        np.testing.assert_allclose(getattr(quick, name), getattr(whole, name), rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(quick_series, whole_series, rtol=1e-7, atol=1e-9)


def test_covariances_settle_where_frames_show_the_same_and_change_where_they_do_not():
    chain, seen = smoothing.series_chain(np.ones(3), np.full(3, 0.5)), with_a_gap()
    _, expected = smoothing._series_filtered(np.zeros(seen.shape), seen, 0.1, chain)
    known = [id(P) for P in expected]
    assert len(set(known[40:50])) == len(set(known[110:])) == 1
    assert len(set(known)) > 20
    assert known[49] != known[51]
    assert known[69] != known[71]


def test_factors_are_learned_through_gaps():
    rng = np.random.default_rng(3)
    truth = rng.normal(size=(300, 3)) @ rng.normal(size=(3, 12)) / 2.0
    X = with_gaps(truth + 0.01 * rng.normal(size=truth.shape), 0.3)
    filled = interpolated(X, np.arange(300.0))
    factors = MotionFactors.learned(X, filled, 0.01, 3)
    z, _ = factors.posterior(X)
    assert rms(factors.frames(z) - truth) < 0.05
    np.testing.assert_allclose(
        factors.weights @ factors.weights.T, np.cov(truth.T), atol=0.1 * truth.var(axis=0).max()
    )


def test_lines_across_gaps_meet_what_is_beside_them():
    time = np.array([0.0, 1.0, 3.0, 4.0, 5.0])
    X = np.array([[np.nan, 1.0], [2.0, np.nan], [np.nan, 4.0], [8.0, np.nan], [np.nan, np.nan]])
    expected = [[2.0, 1.0], [2.0, 2.0], [6.0, 4.0], [8.0, 4.0], [8.0, 4.0]]
    np.testing.assert_allclose(interpolated(X, time), expected)


@pytest.mark.parametrize("sigma", [0.02, 0.05, 0.1])
def test_the_noise_of_a_capture_is_found_through_motion_and_gaps(frames, sigma):
    noisy = frames + sigma * np.random.default_rng(0).normal(size=frames.shape)
    assert capture_noise(with_gaps(noisy)) == pytest.approx(sigma, rel=0.1)


def test_without_noise_or_neighbours_there_is_little_or_none(frames):
    assert capture_noise(frames) < 0.02 * frames.std(axis=0).max()
    assert capture_noise(frames[:2]) == 0.0


@pytest.mark.parametrize("hide", [with_gaps, with_bursts])
@pytest.mark.parametrize("sigma", [0.0, 0.05])
def test_gaps_are_filled_better_than_by_lines_or_by_frames_alone(frames, hide, sigma):
    noisy = frames + sigma * np.random.default_rng(0).normal(size=frames.shape)
    X = hide(noisy)
    hidden = np.isnan(X)
    error = rms((estimated(X).frames - frames)[hidden])
    assert error < 0.7 * rms((interpolated(X, np.arange(400.0)) - frames)[hidden])
    if sigma:  # these few factors without noise are exact for any linear method
        assert error < 0.9 * rms((fill_gaps(X) - frames)[hidden])


def test_noise_is_more_than_halved(frames):
    noisy = frames + 0.1 * np.random.default_rng(0).normal(size=frames.shape)
    assert rms(estimated(noisy).frames - frames) < 0.5 * 0.1


def test_a_clean_take_is_left_as_it_is(frames):
    found = estimated(frames)
    assert rms(found.frames - frames) < 2.0 * found.sigma


def test_uncertainty_tells_the_size_of_errors(frames):
    noisy = frames + 0.05 * np.random.default_rng(0).normal(size=frames.shape)
    X = with_bursts(with_gaps(noisy))
    found = estimated(X)
    off, hidden = np.abs(found.frames - frames), np.isnan(X)
    for entries in (hidden, ~hidden):
        assert (off < 2.0 * found.std)[entries].mean() > 0.8
    assert found.std[hidden].mean() > found.std[~hidden].mean()


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_units_and_origin_do_not_matter(frames, scale):
    X = with_gaps(frames[:200])
    one, other = estimated(X), estimated(scale * X + 7.0)
    np.testing.assert_allclose(other.frames, scale * one.frames + 7.0, atol=1e-5 * scale)
    np.testing.assert_allclose(other.std, scale * one.std, rtol=1e-3)


def test_a_given_noise_is_believed(frames):
    noisy = (frames + 0.05 * np.random.default_rng(0).normal(size=frames.shape))[:200]
    assert rms(estimated(noisy, 0.0).frames - noisy) < rms(estimated(noisy, 0.2).frames - noisy)
    assert estimated(noisy, 0.2).sigma == 0.2


def test_columns_never_seen_stay_open(frames):
    X = frames.copy()
    X[:, 3:6] = np.nan
    found = estimated(X)
    np.testing.assert_array_equal(np.isnan(found.frames), np.isnan(X))
    np.testing.assert_array_equal(np.isnan(found.std), np.isnan(X))


@pytest.mark.parametrize("count", [2, 3, 10])
def test_few_frames_are_enough_not_to_fail(frames, count):
    found = estimated(frames[:count])
    assert np.isfinite(found.frames).all()
    assert np.isfinite(found.std).all()


def test_a_gap_in_time_is_a_gap_in_the_frames(frames):
    time = np.arange(len(frames)) / 30.0
    kept = np.r_[0:100, 103:400]
    hidden = frames.copy()
    hidden[100:103] = np.nan
    through, across = estimate(hidden, time), estimate(frames[kept], time[kept])
    np.testing.assert_allclose(across.frames, through.frames[kept], atol=1e-10)
    assert even_grid(time[kept])[0][-1] == 399


def test_a_face_seen_for_a_moment_of_a_long_take_is_smoothed_there(frames):
    X = np.full((5000, frames.shape[1]), np.nan)
    X[60:200] = frames[:140]
    found = estimated(X)
    assert np.isfinite(found.frames).all()
    assert np.isfinite(found.std).all()
    assert rms((found.frames - X)[60:200]) < 0.05 * frames.std()


def test_packets_that_come_in_bursts_have_the_rate_that_they_have_on_average():
    time = np.repeat(np.arange(60) * 0.05, 3) + np.tile([0.0, 1e-4, 2e-4], 60)
    places, step = even_grid(time)
    assert 0.01 < step < 0.02
    assert places[-1] < 2 * len(time)


def test_gaps_of_hours_are_cut_short():
    places, step = even_grid(np.array([0.0, 0.1, 0.2, 7200.0]))
    assert places.tolist() == [0, 1, 2, 2 + LONGEST]
    assert step == pytest.approx(0.1)


def test_single_poses_and_still_faces_are_left_alone(frames, caplog):
    rng, time = np.random.default_rng(0), np.arange(400.0)
    assert estimate_if_it_moves(frames[:5], time[:5]) is None
    assert estimate_if_it_moves(np.ones((20, 6)), time[:20]) is None
    assert not caplog.messages
    assert estimate_if_it_moves(rng.permutation(frames), time) is None
    assert "do not follow each other" in caplog.text
    assert estimate_if_it_moves(frames, time) is not None


@pytest.mark.parametrize("sigma", [0.0, 0.05])
def test_the_step_from_frame_to_frame_is_found_through_noise(frames, sigma):
    noisy = frames + sigma * np.random.default_rng(0).normal(size=frames.shape)
    true = np.sqrt((np.diff(frames, axis=0) ** 2).mean(axis=0).max())
    assert largest_step(with_gaps(noisy), sigma) == pytest.approx(true, rel=0.2)
    assert estimated(noisy).sigma_t == pytest.approx(true, rel=0.2)


def test_the_noise_of_two_frames_is_not_a_step():
    rng = np.random.default_rng(0)
    X = 0.3 * np.arange(4000.0)[:, None] * [1.0, 0.5, 0.0] + 0.2 * rng.normal(size=(4000, 3))
    assert largest_step(X, 0.2) == pytest.approx(0.3, rel=0.05)


def test_a_take_in_which_nothing_moves_is_refused():
    with pytest.raises(InputError, match="change"):
        estimated(np.ones((10, 6)))


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "target"), [("utterance_b", "arkit"), ("optical_eyebrows", "solved")]
)
def test_real_markers_come_back_better_than_by_lines_or_by_frames_alone(real_data, name, target):
    source = read_take_file(real_data / "tracks" / f"{name}.npz", target=target).source
    truth = source.matrix[:600]
    noisy = truth + 0.05 * truth.std() * np.random.default_rng(0).normal(size=truth.shape)
    X = with_bursts(noisy)
    hidden = np.isnan(X)
    error = rms((estimated(X).frames - truth)[hidden])
    assert error < 0.8 * rms((interpolated(X, np.arange(600.0)) - truth)[hidden])
    assert error < 0.8 * rms((fill_gaps(X) - truth)[hidden])
