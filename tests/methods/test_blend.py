"""`auto`: experts, and how they share."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from facert.data.arrays import rms
from facert.methods.base import Labelled, Unlabelled
from facert.methods.blend import MOST_POSES, TOGETHER, Auto, _fewer_poses, blend_weights
from facert.methods.registry import make_method
from facert.settings import Settings


def data(labels=12, frames=300, poses=200, seed=3, bend=0.5):
    """Poses that follow frames of rank 6, the more so the larger `bend` in a curve; and a test."""
    rng = np.random.default_rng(seed)
    Z = rng.normal(size=(labels + frames + poses + 300, 6))
    X = Z @ rng.normal(size=(6, 24)) / 2.5 + 0.1 * rng.normal(size=(len(Z), 24))
    Y = np.tanh(bend * Z @ rng.normal(size=(6, 9)) / 2.5) / bend
    first, second = labels + frames, labels + frames + poses
    return (
        Labelled(X[:labels], Y[:labels]),
        Unlabelled(X[labels:first], Y[first:second]),
        Labelled(X[second:], Y[second:]),
    )


def fitted(labelled, unlabelled, name="auto"):
    method = make_method(Settings(method=name))
    method.fit(labelled, unlabelled)
    return method


@pytest.fixture(scope="module")
def auto():
    return fitted(*data()[:2])


def test_it_is_better_than_each_supervised_method_and_unlabelled_data_is_why():
    labelled, unlabelled, test = data(labels=10, bend=0.2)
    nothing = Unlabelled(unlabelled.X[:0], unlabelled.Y[:0])

    def error(name, unlabelled):
        return rms(fitted(labelled, unlabelled, name).predict(test.X).Y - test.Y)

    best = min(error(name, nothing) for name in ("gpr", "gpr-linear", "ridge", "pls"))
    assert error("auto", unlabelled) < 0.9 * best
    assert error("auto", unlabelled) < 0.8 * error("auto", nothing)


def test_poses_lie_between_those_of_the_experts(auto):
    test = data()[2]
    map_ = auto.map_
    factors, missed = map_.factors(test.X)[0], map_.residual(test.X)[0]
    low, high = map_.range
    clipped = np.clip(factors, low, high)
    predicted = np.clip(
        [
            map_.plain(test.X)[0],
            map_.whitened(test.X)[0],
            map_.shrinkage(clipped),
            map_.residual_shrinkage(np.clip(clipped + missed, low, high)),
        ],
        low,
        high,
    )
    pose = auto.predict(test.X).Y
    np.testing.assert_allclose(
        pose, sum(w * s for w, s in zip(map_.weights, predicted, strict=True))
    )


def test_the_variance_is_that_of_the_experts_weighted_alike(auto):
    """Of processes their own, of the shrunk factors their error in cross-validation."""
    map_, X = auto.map_, data()[2].X
    weights = np.array([0.1, 0.2, 0.3, 0.4])
    of_processes = [p(X)[1]() for p in (map_.plain, map_.whitened, map_.residual)]
    expected = np.tensordot(weights[[0, 1, 3]], of_processes, axes=1) + 0.3 * map_.factor_error**2
    np.testing.assert_allclose(replace(map_, weights=weights)(X)[1](), expected, rtol=1e-9)


def test_no_pose_leaves_the_range_of_those_that_are_known(auto):
    labelled, unlabelled, test = data()
    poses = np.vstack([labelled.Y, unlabelled.Y])
    pose = auto.predict(5.0 * test.X).Y
    assert (pose >= poses.min(axis=0) - 1e-12).all()
    assert (pose <= poses.max(axis=0) + 1e-12).all()


def test_the_error_that_is_reported_is_about_the_true_one():
    labelled, unlabelled, test = data(labels=40)
    method = Auto(Settings())
    report = method.fit(labelled, unlabelled)
    true = rms(method.predict(test.X).Y - test.Y)
    assert 0.7 * true < report.pose_figures["cross-validation error"] < 1.4 * true


def test_the_report_names_experts_and_what_was_used():
    report = Auto(Settings()).fit(*data()[:2])
    weights = [value for name, value in report.figures.items() if name.startswith("weight of")]
    assert len(weights) == 4
    assert sum(weights) == pytest.approx(1.0)
    assert report.figures["unlabelled frames"] == 300
    assert report.figures["unlabelled poses"] == 200


def test_of_very_many_poses_some_are_drawn_by_the_seed():
    poses = np.arange(2.0 * MOST_POSES)[:, None]
    some, same, other = (_fewer_poses(Unlabelled(poses, poses), seed).Y for seed in (0, 0, 1))
    assert len(some) == len(np.unique(some)) == MOST_POSES
    assert (np.diff(some[:, 0]) > 0).all()
    np.testing.assert_array_equal(some, same)
    assert (some != other).any()
    assert len(_fewer_poses(Unlabelled(poses, poses[:9]), 0).Y) == 9


@pytest.mark.parametrize("value", [0.0, 0.3])
def test_poses_that_are_all_the_same_stay_the_same(value):
    labelled, unlabelled, test = data()
    method = fitted(
        Labelled(labelled.X, np.full_like(labelled.Y, value)),
        Unlabelled(unlabelled.X, np.full_like(unlabelled.Y, value)),
    )
    np.testing.assert_allclose(method.predict(test.X).Y, value)


def test_a_switch_is_learned():
    labelled, unlabelled, test = data(labels=30)

    def on(Y):
        return (Y[:, :2] > 0.0).astype(float)

    method = fitted(
        Labelled(labelled.X, on(labelled.Y)), Unlabelled(unlabelled.X, on(unlabelled.Y))
    )
    assert np.mean((method.predict(test.X).Y > 0.5) == on(test.Y)) > 0.85


def errors(seed=0):
    return list(np.random.default_rng(seed).normal(size=(4, 10, 3)))


def test_weights_are_shares():
    weights = blend_weights(errors())

    assert weights.sum() == pytest.approx(1.0)
    assert (weights >= 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_weights_are_the_best_shares(seed):
    missed = errors(seed)
    least = min(np.sum(e**2) for e in missed)

    def cost(weights):
        mixed = np.tensordot(weights, np.array(missed), axes=1)
        return np.sum(mixed**2) + TOGETHER * least * np.sum(weights**2)

    best = cost(blend_weights(missed))
    for shares in np.random.default_rng(seed).dirichlet(np.ones(4), 200):
        assert cost(shares) >= best


@pytest.mark.parametrize("worse", [1.0, 2.0, 9.0])
def test_two_experts_whose_errors_are_unrelated_share_by_their_squares(worse):
    """The Lagrangian's minimum: w₁ (E₁ + ρ E) = w₂ (E₂ + ρ E), E the lesser, ρ = 0.3."""
    errors = np.array([[1.0, 0.0]]), np.array([[0.0, worse**0.5]])
    first, second = blend_weights(errors)
    assert first * 1.3 == pytest.approx(second * (worse + 0.3))
    assert first + second == pytest.approx(1.0)


def test_the_unit_of_the_errors_does_not_matter():
    np.testing.assert_allclose(
        blend_weights([1e-3 * e for e in errors()]), blend_weights(errors()), atol=1e-12
    )


def test_experts_that_are_alike_share_alike_and_the_better_one_gets_more():
    error = errors()[0]
    np.testing.assert_allclose(blend_weights([error, error, error]), 1 / 3)
    shares = [blend_weights([factor * error, error])[0] for factor in (1.0, 0.8, 0.5, 0.01)]
    assert all(a <= b for a, b in pairwise(shares))
    assert shares[1] > shares[0]
    assert shares[-1] == pytest.approx(1.0, abs=1e-3)


def test_experts_that_err_in_opposite_ways_are_mixed():
    error = errors()[0]
    np.testing.assert_allclose(blend_weights([error, -error]), [0.5, 0.5])


def test_an_expert_that_misses_nothing_takes_all():
    error = errors()[0]
    np.testing.assert_allclose(blend_weights([0.0 * error, error]), [1.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(blend_weights([0.0 * error, 0.0 * error]), 0.5)
