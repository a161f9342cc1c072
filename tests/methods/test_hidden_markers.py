"""The standard deviation of poses from frames that hide some of their markers."""

from itertools import pairwise

import numpy as np
import pytest

from facert.data.arrays import rms
from facert.methods.base import Labelled, Unlabelled
from facert.methods.registry import REGISTRY, make_method, method_class
from facert.settings import Settings

# Every regression that predicts a standard deviation.
WITH_STD = [
    name
    for name in REGISTRY
    if not method_class(name).stepwise and method_class(name).map_type.predicts_std
]
with_std = pytest.mark.parametrize("name", WITH_STD)


def data(seed=0):
    """Frames and poses that four factors move, a few of them pairs; and a test."""
    rng = np.random.default_rng(seed)
    Z = rng.normal(size=(1000, 4))
    X = Z @ rng.normal(size=(4, 12)) / 2.0 + 0.2 * rng.normal(size=(1000, 12))
    Y = Z @ rng.normal(size=(4, 6)) / 2.0 + 0.2 * rng.normal(size=(1000, 6))
    labelled, unlabelled = Labelled(X[:30], Y[:30]), Unlabelled(X[30:400], Y[400:600])
    return labelled, unlabelled, Labelled(X[600:], Y[600:])


@pytest.fixture(scope="module")
def trained():
    """A method of each name, trained once."""
    kept = {}

    def train(name):
        if name not in kept:
            kept[name] = make_method(Settings(method=name))
            kept[name].fit(*data()[:2])
        return kept[name]

    return train


def hide(X, count, seed=0):
    """So many of the columns of each frame are not observed."""
    ranks = np.random.default_rng(seed).random(X.shape).argsort(axis=1)
    return np.where(ranks < count, np.nan, X)


def test_the_blend_and_all_gaussian_processes_are_tried_here():
    assert set(WITH_STD) == {"auto", "ssgpr", "gpr", "gpr-linear"}


@with_std
def test_of_complete_frames_it_is_the_maps_own(name, trained):
    X = data()[2].X
    method = trained(name)
    np.testing.assert_array_equal(method.predict(X).std, np.sqrt(method.map_(X)[1]()))


@with_std
def test_poses_are_those_of_the_filled_frames(name, trained):
    method, X = trained(name), hide(data()[2].X, 5)
    filled = method.map_(method.gaps_.fill(X))[0]
    np.testing.assert_allclose(method.predict(X).Y, filled, rtol=1e-8, atol=1e-8)


@with_std
def test_it_grows_with_what_is_hidden(name, trained):
    X = data()[2].X
    stds = [trained(name).predict(hide(X, count)).std for count in range(0, 13, 3)]
    for less, more in pairwise(stds):
        assert more.mean() > less.mean()
    assert np.mean(stds[3] > stds[1]) > 0.9


@with_std
def test_a_frame_that_shows_nothing_leaves_about_the_spread_of_all_poses(name, trained):
    labelled, unlabelled, _ = data()
    std = trained(name).predict(np.full((1, 12), np.nan)).std[0]
    spread = np.vstack([labelled.Y, unlabelled.Y]).std(axis=0)
    np.testing.assert_allclose(std, spread, rtol=0.35)


@with_std
@pytest.mark.parametrize("count", [0, 3, 6, 9, 12])
def test_it_is_within_a_factor_of_two_of_the_errors(name, trained, count):
    test = data()[2]
    predicted = trained(name).predict(hide(test.X, count))
    assert 0.5 < rms((predicted.Y - test.Y) / predicted.std) < 2.0


@with_std
def test_it_is_kept_with_the_model(name, trained):
    X = hide(data()[2].X, 5)
    loaded = make_method(Settings(method=name))
    loaded.load(trained(name).save())
    np.testing.assert_allclose(loaded.predict(X).std, trained(name).predict(X).std)


def test_the_variance_of_filled_numbers_is_carried_on_by_the_linear_map():
    """var(x A) = Σ_d var(x_d) A_d², beside what the frame itself leaves open."""
    rng = np.random.default_rng(0)
    X, A = rng.normal(size=(200, 6)), rng.normal(size=(6, 3))
    method = make_method(Settings(method="gpr-linear"))
    method.fit(Labelled(X[:40], X[:40] @ A), Unlabelled(X[40:], X[40:] @ A))
    variance = rng.random((20, 6))
    plain, filled = method.predict(X[:20]), method.predict(X[:20], variance)
    np.testing.assert_allclose(filled.Y, plain.Y)
    np.testing.assert_allclose(filled.std**2 - plain.std**2, variance @ A**2, rtol=1e-3)
