"""Factors as a map, and the base maps in cross-validation."""

import numpy as np

from facert.data.arrays import rms
from facert.methods.base import Labelled, Unlabelled
from facert.methods.blend import BaseMaps, cross_validated_poses
from facert.methods.factors import FactorMap
from facert.methods.folds import ranked_folds


def data(labels=11, frames=60, poses=40, seed=0):
    """Frames of rank 4 with noise, and poses that are linear in them, closed half of the time."""
    rng = np.random.default_rng(seed)
    Z = rng.normal(size=(labels + frames + poses, 4))
    X = Z @ rng.normal(size=(4, 9)) + 0.05 * rng.normal(size=(len(Z), 9))
    Y = np.maximum(Z @ rng.normal(size=(4, 5)), 0.0) + 1.0
    return Labelled(X[:labels], Y[:labels]), Unlabelled(
        X[labels : labels + frames], Y[labels + frames :]
    )


def map_of(low, high, spread=0.1):
    """One control that is its one marker."""
    bounds = np.array([[low], [high]])
    censored = np.isfinite(bounds)
    return FactorMap(
        centre=np.zeros(1),
        weights=np.ones((1, 1)),
        offset=np.zeros(1),
        spread=np.full(1, spread),
        limits=np.where(censored, bounds, 0.0),
        censored=censored.astype(float),
    )


def test_without_limits_the_map_is_linear():
    X = np.linspace(-3.0, 3.0, 7)[:, None]
    np.testing.assert_array_equal(map_of(-np.inf, np.inf)(X)[0], X)


def test_limits_bend_the_map_smoothly_and_are_not_passed():
    X = np.linspace(-3.0, 3.0, 601)[:, None]
    pose, _ = map_of(0.0, 1.0)(X)
    assert (pose > -1e-12).all()
    assert (pose < 1.0 + 1e-12).all()
    assert (np.diff(pose[:, 0]) > -1e-12).all()
    far = np.abs(X) > 2.0
    np.testing.assert_allclose(pose[far], np.clip(X, 0.0, 1.0)[far], atol=1e-12)
    np.testing.assert_allclose(pose, np.clip(X, 0.0, 1.0), atol=0.041)  # s φ(0)


def test_controls_that_are_often_closed_get_a_limit_there():
    labelled, unlabelled = data()
    factors = BaseMaps.learn(labelled, unlabelled).factors
    np.testing.assert_array_equal(factors.censored, [np.ones(5), np.zeros(5)])
    np.testing.assert_allclose(factors.limits[0], 1.0)
    assert (factors(unlabelled.X)[0] > 1.0).all()


def test_ranked_folds_cover_every_label_once_and_each_has_calm_and_extreme_ones():
    X = np.random.default_rng(0).normal(size=(23, 4))
    far = np.linalg.norm(X - X.mean(axis=0), axis=1)
    folds = ranked_folds(X)
    np.testing.assert_array_equal(np.sort(np.concatenate([test for _, test in folds])), range(23))
    for train, test in folds:
        np.testing.assert_array_equal(np.sort(np.concatenate([train, test])), range(23))
        assert far[test].min() < np.median(far) < far[test].max()


def test_ranked_folds_do_not_depend_on_the_order_of_frames():
    X = np.random.default_rng(0).normal(size=(23, 4))
    order = np.random.default_rng(1).permutation(23)
    folds = [test for _, test in ranked_folds(X)]
    permuted = [np.sort(order[test]) for _, test in ranked_folds(X[order])]
    for a, b in zip(folds, permuted, strict=True):
        np.testing.assert_array_equal(a, b)


def test_three_labels_make_three_folds():
    X = np.random.default_rng(0).normal(size=(3, 2))
    assert [len(test) for _, test in ranked_folds(X)] == [1, 1, 1]


def validated(labelled, unlabelled):
    """Cross-validated poses beside the maps of all labels."""
    maps = BaseMaps.learn(labelled, unlabelled)
    return cross_validated_poses(labelled, unlabelled, maps)


def test_cross_validated_poses_do_not_depend_on_the_labels_own_poses():
    labelled, unlabelled = data()
    predicted = validated(labelled, unlabelled)
    assert predicted.shape == (3, 11, 5)
    _, test = ranked_folds(labelled.X)[2]
    poses = labelled.Y.copy()
    poses[test] = 99.0
    again = validated(Labelled(labelled.X, poses), unlabelled)
    np.testing.assert_array_equal(again[:, test], predicted[:, test])
    others = np.delete(np.arange(11), test)
    assert (np.abs(again[:, others] - predicted[:, others]).max(axis=(1, 2)) > 0.1).all()


def test_cross_validated_poses_are_those_of_maps_without_the_fold():
    labelled, unlabelled = data()
    predicted = validated(labelled, unlabelled)
    train, test = ranked_folds(labelled.X)[0]
    frames = np.vstack([unlabelled.X, labelled.X[test]])
    rest = Labelled(labelled.X[train], labelled.Y[train])
    maps = BaseMaps.learn(rest, Unlabelled(frames, unlabelled.Y))
    np.testing.assert_array_equal(maps(labelled.X[test]), predicted[:, test])


def test_the_search_for_factors_begins_between_both_processes(monkeypatch):
    labelled, unlabelled = data()
    begun, learn = [], FactorMap.learn

    def note(labelled, unlabelled, guess):
        begun.append(guess)
        return learn(labelled, unlabelled, guess)

    monkeypatch.setattr(FactorMap, "learn", note)
    maps = BaseMaps.learn(labelled, unlabelled)
    both = [process(unlabelled.X)[0] for process in (maps.plain, maps.whitened)]
    np.testing.assert_allclose(begun[0], np.mean(both, axis=0))


def learned(labelled, unlabelled):
    """Factors begun at a linear regression."""
    ones = [np.column_stack([view.X, np.ones(len(view.X))]) for view in (labelled, unlabelled)]
    slopes, *_ = np.linalg.lstsq(ones[0], labelled.Y)
    return FactorMap.learn(labelled, unlabelled, ones[1] @ slopes)


def test_poses_that_are_closed_half_of_the_time_are_predicted_around_their_free_mean():
    """It is far below the mean of the poses themselves."""
    labelled, unlabelled = data(labels=20)
    found = learned(labelled, unlabelled)
    assert (found.offset < np.vstack([labelled.Y, unlabelled.Y]).mean(axis=0) - 0.3).all()
    assert rms(found(labelled.X)[0] - labelled.Y) < 0.15 * labelled.Y.std()


def test_poses_and_their_limits_may_lie_anywhere():
    labelled, unlabelled = data(labels=20)
    moved = learned(
        Labelled(labelled.X, labelled.Y - 7.0), Unlabelled(unlabelled.X, unlabelled.Y - 7.0)
    )
    expected = learned(labelled, unlabelled)(labelled.X)[0] - 7.0
    np.testing.assert_allclose(moved(labelled.X)[0], expected, atol=1e-8)
