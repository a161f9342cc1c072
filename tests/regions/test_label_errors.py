"""Left-out errors in closed form are those of leaving out."""

import numpy as np

from facert.models.whitening import whitening
from facert.regions.automatic import FREE, POWER, RIDGE, label_errors


def make_data(seed=0, labels=9):
    rng = np.random.default_rng(seed)
    frames = rng.normal(size=(60, 3)) @ rng.normal(size=(3, 7))
    poses = frames[:labels] @ rng.normal(size=(7, 4)) + 0.1 * rng.normal(size=(labels, 4))
    return frames, frames[:labels], poses


def test_each_label_is_predicted_from_the_others():
    frames, labelled, poses = make_data()
    features = (labelled - labelled.mean(axis=0)) @ whitening(frames, POWER)
    K = features @ features.T
    K = K / (np.trace(K) / len(K)) + FREE
    Y = poses - poses.mean(axis=0)
    errors = np.empty_like(Y)
    for i in range(len(Y)):
        rest = np.arange(len(Y)) != i
        inside = K[np.ix_(rest, rest)] + RIDGE * np.eye(rest.sum())
        errors[i] = Y[i] - K[i, rest] @ np.linalg.solve(inside, Y[rest])
    expected = (errors**2).sum(axis=0) / (Y**2).sum(axis=0)
    np.testing.assert_allclose(label_errors(frames, labelled, poses), expected, rtol=1e-9)


def test_neither_unit_nor_origin_matters():
    frames, labelled, poses = make_data()
    moved = label_errors(25.4 * frames + 100.0, 25.4 * labelled + 100.0, 0.01 * poses - 3.0)
    np.testing.assert_allclose(moved, label_errors(frames, labelled, poses), rtol=1e-6)


def test_what_never_moves_has_an_error_of_one():
    frames, labelled, poses = make_data()
    poses[:, 2] = 0.3
    assert label_errors(frames, labelled, poses)[2] == 1.0
    still = label_errors(np.ones_like(frames), np.ones_like(labelled), poses)
    np.testing.assert_array_equal(still, 1.0)
    nothing = label_errors(frames[:, :0], labelled[:, :0], poses)
    np.testing.assert_array_equal(nothing, 1.0)
