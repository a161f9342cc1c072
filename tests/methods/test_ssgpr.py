"""One Gaussian process on features of all frames, shrunk by all poses."""

import numpy as np

from facert.data.arrays import rms
from facert.methods.base import Labelled, Unlabelled
from facert.methods.ssgpr import SemiSupervisedGPR
from facert.settings import Settings


def test_more_unlabelled_frames_and_poses_help():
    rng = np.random.default_rng(3)
    directions, _ = np.linalg.qr(rng.normal(size=(30, 30)))
    signal = rng.normal(size=(400, 8)) * 3.0 ** -np.arange(8)
    X = signal @ directions[:, :8].T + 0.02 * rng.normal(size=(400, 30))
    Y = np.tanh(X @ rng.normal(size=(30, 6)))

    def error(count):
        method = SemiSupervisedGPR(Settings(method="ssgpr"))
        method.fit(Labelled(X[:12], Y[:12]), Unlabelled(X[12 : 12 + count], Y[12 : 12 + count]))
        return rms(method.predict(X[212:]).Y - Y[212:])

    assert error(200) < 0.95 * error(0)


def test_a_source_of_one_number_is_enough():
    x = np.linspace(-2.0, 2.0, 40)[:, None]
    method = SemiSupervisedGPR(Settings(method="ssgpr"))
    method.fit(Labelled(x[::4], np.sin(x[::4])), Unlabelled(x, np.sin(x)))

    assert rms(method.predict(x).Y - np.sin(x)) < 0.05
