"""Folds of many labels share their work, and say what folds on their own would."""

import numpy as np
import pytest

from facert.methods import blend, processes
from facert.methods.base import Labelled, Unlabelled
from facert.methods.blend import BaseMaps, cross_validated_poses
from facert.methods.held_out import held_out
from facert.methods.processes import MOST_KERNELS, Basis, FeatureProcess, ProcessBank, ProcessMap
from facert.models.factors import factor_analysis
from facert.models.gp import hyperparameters
from facert.models.kernels import RegressionKernel
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


@pytest.fixture(name="many")
def _many(monkeypatch):
    """Labels whose kernel is known, so that folds have the same one."""
    kernel = RegressionKernel(0.6, 0.2, 1.0 / 80.0, 0.3)
    found = hyperparameters.MaximumLikelihood(kernel, 0.0, 25)
    monkeypatch.setattr(processes, "maximise_likelihood", lambda *_: found)
    monkeypatch.setattr(factor_analysis, "ITERATIONS", 3)
    X, Y = frames_and_poses(50)
    labelled, unlabelled = Labelled(X[:25], Y[:25]), Unlabelled(X[25:], Y[25:])
    return labelled, unlabelled, BaseMaps.learn(labelled, unlabelled)


def test_cross_validation_with_shared_work_says_the_same(many, monkeypatch):
    expected = cross_validated_poses(*many)
    monkeypatch.setattr(blend, "FEW", 24)
    np.testing.assert_allclose(cross_validated_poses(*many), expected, atol=1e-7)


def test_no_kernel_is_searched_in_folds_of_many_labels(many, monkeypatch):
    monkeypatch.setattr(blend, "FEW", 24)
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
