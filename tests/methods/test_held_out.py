"""Folds of many labels share their work, and say what folds on their own would."""

import numpy as np
import pytest

from facert.data.arrays import rms
from facert.methods import blend
from facert.methods.base import Labelled, Unlabelled
from facert.methods.blend import BaseMaps, cross_validated_poses
from facert.methods.held_out import held_out
from facert.methods.processes import MOST_KERNELS, Basis, FeatureProcess, ProcessBank, ProcessMap
from facert.models.factors import factor_analysis
from facert.models.gp import hyperparameters
from facert.models.threads import SMALL

THETA = np.array([0.6, 0.2, 80.0, 0.3])


def frames_and_poses(count, seed=0):
    rng = np.random.default_rng(seed)
    Z = rng.normal(size=(count, 3))
    X = Z @ rng.normal(size=(3, 7)) + 0.05 * rng.normal(size=(count, 7))
    return X, np.tanh(Z @ rng.normal(size=(3, 4)))


def process(X, Y, mean, basis):
    return FeatureProcess(
        basis.centre, basis.matrix, mean, ProcessMap(basis.features(X), Y - mean, THETA)
    )


def test_a_process_without_a_fold_is_the_one_of_the_other_labels():
    X, Y = frames_and_poses(45)
    basis = Basis.half_whitened(X)
    folds, means = [np.arange(0, 30, 3), np.array([31, 7])], np.array([[0.1] * 4, [-0.2] * 4])
    frames = frames_and_poses(20, seed=1)[0]
    found = held_out(process(X[:30], Y[:30], Y.mean(axis=0), basis), [folds[0]], means[:1])(frames)
    rest = np.delete(np.arange(30), folds[0])
    np.testing.assert_allclose(
        found[0], process(X[rest], Y[rest], means[0], basis)(frames)[0], atol=1e-9
    )
    both = held_out(process(X, Y, Y.mean(axis=0), basis), folds, means)(frames)
    for poses, fold, mean in zip(both, folds, means, strict=True):
        rest = np.delete(np.arange(45), fold)
        expected = process(X[rest], Y[rest], mean, basis)(frames)[0]
        np.testing.assert_allclose(poses, expected, atol=1e-9)


@pytest.fixture(name="many", scope="module")
def _many():
    """More labels than are searched for a kernel, if those are few."""
    X, Y = frames_and_poses(70)
    labelled, unlabelled = Labelled(X[:40], Y[:40]), Unlabelled(X[40:], Y[40:])
    return labelled, unlabelled, BaseMaps.learn(labelled, unlabelled)


def test_cross_validation_with_shared_work_says_the_same(many, monkeypatch):
    monkeypatch.setattr(factor_analysis, "ITERATIONS", 10)
    expected = cross_validated_poses(*many)
    monkeypatch.setattr(blend, "MOST_SEARCHED", 39)
    found = cross_validated_poses(*many)
    assert rms(found - expected) < 0.1 * rms(expected - many[0].Y)


def test_kernels_are_searched_once_however_many_folds_there_are(many, monkeypatch):
    monkeypatch.setattr(factor_analysis, "ITERATIONS", 1)
    monkeypatch.setattr(blend, "MOST_SEARCHED", 39)
    monkeypatch.setattr(FeatureProcess, "learn", None)
    cross_validated_poses(*many)


def test_the_search_sees_at_most_so_many_rows(monkeypatch):
    rows = []

    class Counting(hyperparameters._Profile):
        def __init__(self, X, Y):
            rows.append(len(X))
            super().__init__(X, Y)

    monkeypatch.setattr(hyperparameters, "_Profile", Counting)
    monkeypatch.setattr(hyperparameters, "MOST_SEARCHED", 20)
    found = [hyperparameters.maximise_likelihood(*frames_and_poses(n)).rows for n in (20, 21, 70)]
    assert found == rows == [20, 11, 18]


def test_many_frames_are_mapped_in_parts(monkeypatch):
    X, Y = frames_and_poses(30)
    basis, mean = Basis.plain(X), Y.mean(axis=0)
    bank = ProcessBank([process(X, Y, mean, basis), process(X, Y, 0.0 * mean, basis)])
    assert bank._rows == MOST_KERNELS // 60
    poses, variances = bank(X)
    bank._rows = 7
    in_parts, their_variances = bank(X)
    np.testing.assert_allclose(in_parts, poses, atol=1e-12)
    np.testing.assert_allclose(their_variances(), variances(), atol=1e-12)


def test_many_labels_are_solved_without_an_inverse():
    X, Y = frames_and_poses(SMALL + 1)
    found = ProcessMap(X, Y, THETA)
    weights = found.alpha
    assert "whitening" not in vars(found)
    np.testing.assert_allclose(weights, found.whitening @ (found.whitening.T @ Y), atol=1e-8)
