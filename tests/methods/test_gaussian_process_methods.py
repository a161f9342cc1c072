"""A Gaussian process on features: in which proportions, and around which pose."""

import numpy as np
import pytest

from facert.methods.base import Labelled
from facert.methods.processes import Basis, FeatureProcess
from facert.models.gp.hyperparameters import maximise_likelihood


@pytest.fixture
def frames():
    """Frames that move in four directions, each half as far as the one before, without noise."""
    rng = np.random.default_rng(0)
    directions, _ = np.linalg.qr(rng.normal(size=(12, 12)))
    return rng.normal(size=(300, 4)) @ (directions[:, :4] * 0.5 ** np.arange(4)).T + 2.0


def test_half_whitened_features_have_the_root_of_each_directions_deviation(frames):
    features = Basis.half_whitened(frames).features(frames)
    raw = np.sqrt(np.linalg.eigvalsh(np.cov(frames.T, bias=True))[::-1][:4])
    found = np.sort(features.std(axis=0))[::-1]
    np.testing.assert_allclose(found[:4], np.sqrt(raw), rtol=1e-2)
    np.testing.assert_allclose(found[4:], 0.0, atol=1e-6)
    np.testing.assert_allclose(features.mean(axis=0), 0.0, atol=1e-9)


def test_the_process_is_of_poses_less_the_pose_expected_before(frames):
    mean = np.array([3.0, -2.0])
    Y = mean + np.sin(frames[:20, :2])
    process = FeatureProcess.learn(Labelled(frames[:20], Y), Basis.plain(frames), mean)
    np.testing.assert_allclose(process(frames[:20])[0], Y, atol=0.05)
    np.testing.assert_allclose(process.process.Y, Y - mean, atol=1e-12)


def test_the_kernel_is_the_most_likely_one_of_all_labels(frames):
    labelled = Labelled(frames[:60], np.sin(frames[:60, :2]))
    process = FeatureProcess.learn(labelled, Basis.plain(frames), np.zeros(2))
    features = frames[:60] - frames.mean(axis=0)
    kernel = maximise_likelihood(features, labelled.Y).kernel
    np.testing.assert_allclose(process.process.theta, [*kernel.theta, kernel.linear], rtol=1e-6)
