"""Factors shared by both views: what their search maximises, and what it does not depend on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from facert.data.arrays import rms
from facert.methods.linear import Ridge
from facert.models.factors import factor_analysis
from facert.models.factors.censoring import CensoringLimits
from facert.models.factors.factor_analysis import FactorData, FactorModel, learn_factors
from facert.settings import Settings


def ridge_weights(data):
    """The slopes of a ridge regression on the pairs alone, (d_x, d_y)."""
    return Ridge(Settings(method="ridge"))._regress(data.X, data.Y)[0].weights


class Truth:
    """Frames and poses of the model itself."""

    def __init__(self, d_x=24, d_y=10, q=4, noise=0.1, seed=0):
        self.rng = np.random.default_rng(seed)
        self.Wx = self.rng.normal(size=(d_x, q)) / np.sqrt(q)
        self.Wy = self.rng.normal(size=(d_y, q)) / np.sqrt(q)
        self.noise = noise

    def regression(self):
        """The best prediction of poses from frames, (d_x, d_y)."""
        covariance = self.Wx @ self.Wx.T + self.noise**2 * np.eye(len(self.Wx))
        return np.linalg.solve(covariance, self.Wx @ self.Wy.T)

    def draw(self, count):
        """Frames (n, d_x) and poses (n, d_y)."""
        Z = self.rng.normal(size=(count, self.Wx.shape[1]))
        X, Y = Z @ self.Wx.T, Z @ self.Wy.T
        return (view + self.noise * self.rng.normal(size=view.shape) for view in (X, Y))

    def data(self, labels=6, frames=600, poses=300, limits=None):
        (X, Y), (alone, _), (_, animation) = map(self.draw, (labels, frames, poses))
        d_y = Y.shape[1]
        limits = limits or CensoringLimits(np.full(d_y, -np.inf), np.full(d_y, np.inf))
        low_high = limits.low, limits.high
        return FactorData(X, np.clip(Y, *low_high), alone, np.clip(animation, *low_high), limits)


def ridge_guess(data):
    return data.frames @ ridge_weights(data)


def log_likelihood(factors: FactorModel, data: FactorData) -> float:
    """Of pairs, frames and poses under the marginal Gaussian distributions of the model."""
    d_x = len(factors.Wx)
    W = np.vstack([factors.Wx, factors.Wy])
    noise = np.concatenate([np.full(d_x, factors.noise_x), factors.noise_y])
    joint = W @ W.T + np.diag(noise)
    mean = np.concatenate([np.zeros(d_x), factors.mean])
    pairs = np.hstack([data.X, data.Y])
    return sum(
        multivariate_normal(mean[view], joint[view, view]).logpdf(rows).sum()
        for rows, view in (
            (pairs, slice(None)),
            (data.frames, slice(None, d_x)),
            (data.poses, slice(d_x, None)),
        )
    )


@pytest.fixture
def nothing_but_likelihood(monkeypatch):
    """Neither priors nor floors."""
    for name in ("PRIOR_POSES", "PRIOR_SHARE"):
        monkeypatch.setattr(factor_analysis, name, 0.0)
    for name in ("SOURCE_FLOOR", "TARGET_FLOOR"):
        monkeypatch.setattr(factor_analysis, name, 1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_no_step_lowers_the_likelihood(nothing_but_likelihood, seed):
    data = Truth(d_x=8, d_y=5, q=3, noise=0.3, seed=seed).data(12, 40, 25)
    guess = 0.5 * ridge_guess(data)
    search = factor_analysis._Search(data, factor_analysis._principal_factors(data, guess))
    curve = [log_likelihood(search.factors, data)]
    for _ in range(25):
        search.step()
        curve.append(log_likelihood(search.factors, data))

    assert (np.diff(curve) > -1e-8 * np.abs(curve[0])).all()
    assert curve[-1] > curve[0] + 1.0


def test_where_the_search_stays_the_likelihood_is_flat(nothing_but_likelihood, monkeypatch):
    """All parameters have derivative zero where the steps end."""
    monkeypatch.setattr(factor_analysis, "ITERATIONS", 3000)
    monkeypatch.setattr(factor_analysis, "FACTORS", 2)
    data = Truth(d_x=4, d_y=3, q=2, noise=0.4).data(15, 30, 20)
    found = learn_factors(data, ridge_guess(data))
    rng = np.random.default_rng(0)
    for name in ("Wx", "Wy", "mean", "noise_y", "noise_x"):
        value = getattr(found, name)
        step = 1e-5 * rng.normal(size=np.shape(value))
        up, down = (
            log_likelihood(replace(found, **{name: value + sign * step}), data) for sign in (1, -1)
        )
        assert abs(up - down) / 2e-5 < 0.02


def expected_moments(search, data):
    """E[z] and E[z zᵀ] of pairs, frames and poses: each conditioned on what it shows."""
    now = search.factors
    W = np.vstack([now.Wx, now.Wy])
    noise = np.diag(np.r_[np.full(len(now.Wx), now.noise_x), now.noise_y])
    mean = np.r_[np.zeros(len(now.Wx)), now.mean]
    views = slice(None), slice(None, len(now.Wx)), slice(len(now.Wx), None)
    rows = np.hstack([data.X, data.Y]), data.frames, data.poses
    for view, shown in zip(views, rows, strict=True):
        gain = np.linalg.solve(W[view] @ W[view].T + noise[view, view], W[view]).T
        Z = (shown - mean[view]) @ gain.T
        yield Z, Z.T @ Z + len(Z) * (np.eye(W.shape[1]) - gain @ W[view])


def regressed(V, Z, squares, start):
    """W of rows V, with a prior worth a fiftieth of them around the first W; what it leaves."""
    k = 0.02 * len(V)
    W = np.linalg.solve(squares + k * np.eye(len(squares)), (V.T @ Z + k * start).T).T
    left = np.sum(V**2, axis=0) - 2.0 * np.sum(W * (V.T @ Z), axis=1)
    return W, left + np.sum((W @ squares) * W, axis=1)


@pytest.mark.parametrize("noise", [1e-3, 0.3])
def test_a_step_is_the_maximisation_with_its_priors_and_its_floors(noise):
    """Ψ as if 20 poses more had shown the mean noise of all controls; both noises have a floor."""
    data = Truth(d_x=8, d_y=5, q=3, noise=noise).data(12, 40, 25)
    search = factor_analysis._Search(
        data, factor_analysis._principal_factors(data, 0.5 * ridge_guess(data))
    )
    search.step()
    (Z, of_pairs), (Z_frames, of_frames), (Z_poses, of_poses) = expected_moments(search, data)
    before, start = search.factors, search.start
    search.step()
    X, Z_x = np.vstack([data.X, data.frames]), np.vstack([Z, Z_frames])
    Wx, left_x = regressed(X, Z_x, of_pairs + of_frames, start.Wx)
    Y, Z_y = np.vstack([data.Y, data.poses]), np.vstack([Z, Z_poses])
    mean = (Y - Z_y @ before.Wy.T).mean(axis=0)
    Wy, left_y = regressed(Y - mean, Z_y, of_pairs + of_poses, start.Wy)
    found = search.factors
    np.testing.assert_allclose(found.Wx, Wx, atol=1e-8)
    np.testing.assert_allclose(found.Wy, Wy, atol=1e-8)
    np.testing.assert_allclose(found.mean, mean, atol=1e-8)
    assert found.noise_x == pytest.approx(max(left_x.sum() / X.size, 3e-5), rel=1e-6)
    shrunk = (left_y + 20.0 * left_y.mean() / len(Y)) / (len(Y) + 20.0)
    np.testing.assert_allclose(found.noise_y, np.maximum(shrunk, 1.5e-2), rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_unlabelled_data_tells_a_linear_map_from_few_labels_far_better_than_ridge(seed):
    truth = Truth(d_x=60, d_y=30, noise=0.3, seed=seed)
    data = truth.data(labels=10, frames=2000, poses=1000)
    X, _ = truth.draw(500)
    best = X @ truth.regression()
    found, _ = learn_factors(data, ridge_guess(data)).regression()
    ridge = ridge_weights(data)

    assert rms(X @ found - best) < 0.5 * rms(X @ ridge - best)


def test_the_std_of_a_pose_is_that_of_its_errors():
    truth = Truth(d_x=60, d_y=30, noise=0.3)
    data = truth.data(labels=20, frames=2000, poses=1000)
    X, Y = truth.draw(2000)
    found = learn_factors(data, ridge_guess(data))
    B, std = found.regression()
    np.testing.assert_allclose((Y - found.mean - X @ B).std(axis=0), std, rtol=0.2)


def test_turning_the_source_turns_its_weights_and_changes_no_pose():
    data = Truth().data()
    guess = ridge_guess(data)
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(24, 24)))
    turned = replace(data, X=data.X @ turn, frames=data.frames @ turn)
    B, std = learn_factors(data, guess).regression()
    B_turned, std_turned = learn_factors(turned, guess).regression()

    np.testing.assert_allclose(B_turned, turn.T @ B, atol=1e-8)
    np.testing.assert_allclose(std_turned, std, atol=1e-8)


def test_permuting_rows_changes_nothing_and_permuting_controls_permutes_the_map():
    truth = Truth()
    zero = np.zeros(10)
    data = truth.data(limits=CensoringLimits(zero, zero + np.inf))
    guess, rng = ridge_guess(data), np.random.default_rng(1)
    labels, frames, poses, controls = map(rng.permutation, (6, 600, 300, 10))
    permuted = replace(
        data,
        X=data.X[labels],
        Y=data.Y[np.ix_(labels, controls)],
        frames=data.frames[frames],
        poses=data.poses[np.ix_(poses, controls)],
    )
    B, std = learn_factors(data, guess).regression()
    found = learn_factors(permuted, guess[np.ix_(frames, controls)]).regression()

    np.testing.assert_allclose(found[0], B[:, controls], atol=1e-7)
    np.testing.assert_allclose(found[1], std[controls], atol=1e-7)


def test_of_frames_without_a_pose_only_the_second_moments_matter():
    data = Truth().data(frames=60)
    guess = ridge_guess(data)
    mix, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(60, 60)))
    B, _ = learn_factors(data, guess).regression()
    mixed, _ = learn_factors(replace(data, frames=mix @ data.frames), mix @ guess).regression()
    np.testing.assert_allclose(mixed, B, atol=1e-8)


def test_knowing_of_limits_a_map_bent_by_them_is_found_straight():
    truth = Truth(noise=0.05, d_y=6)
    zero = np.zeros(6)
    data = truth.data(labels=40, limits=CensoringLimits(zero, zero + np.inf))
    unaware = replace(data, limits=CensoringLimits(zero - np.inf, zero + np.inf))
    X, free = truth.draw(500)

    def error(data):
        found = learn_factors(data, ridge_guess(data))
        return rms(found.mean + X @ found.regression()[0] - free)

    assert error(data) < 0.5 * error(unaware)


@pytest.mark.parametrize(("frames", "poses"), [(0, 0), (0, 50), (50, 0)])
def test_either_kind_of_unlabelled_data_may_be_absent(frames, poses):
    truth = Truth(d_x=8, d_y=4, q=2)
    data = truth.data(12, frames, poses)
    X, Y = truth.draw(200)
    B, std = learn_factors(data, ridge_guess(data)).regression()
    assert rms(X @ B - Y) < 0.6 * Y.std()
    assert np.isfinite(std).all()


def test_three_frames_of_one_dimension_suffice():
    data = Truth(d_x=1, d_y=1, q=1).data(3, 0, 0)
    B, std = learn_factors(data, np.empty((0, 1))).regression()
    assert B.shape == (1, 1)
    assert np.isfinite(B).all()
    assert (std > 0).all()
