"""Variances of single frames: those that wait are worked out together."""

import pickle

import numpy as np
import pytest

from facert.methods.processes import Basis, FeatureProcess, ProcessBank, ProcessMap
from facert.methods.waiting_frames import MOST, WaitingFrames
from facert.models.threads import SMALL

LABELS = SMALL + 1


@pytest.fixture(name="bank", scope="module")
def _bank():
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(LABELS, 4)), rng.normal(size=(LABELS, 2))
    basis, theta = Basis.plain(X), np.array([0.6, 0.2, 80.0, 0.3])
    features = basis.features(X)
    process = ProcessMap(features, Y, theta)
    return ProcessBank([FeatureProcess(basis.centre, basis.matrix, np.zeros(2), process)])


@pytest.fixture(name="frames")
def _frames():
    return np.random.default_rng(1).normal(size=(12, 4))


@pytest.fixture(name="products")
def _products(bank, monkeypatch):
    """How many frames each product was of."""
    counts, whole = [], bank._variances

    def counting(k, squares):
        counts.append(k.shape[1])
        return whole(k, squares)

    monkeypatch.setattr(bank, "_variances", counting)
    return counts


def test_frames_that_wait_take_one_product_and_get_their_own_variances(bank, frames, products):
    asked = [bank(frame[None])[1] for frame in frames]
    found = np.hstack([variances() for variances in asked])
    assert products == [len(frames)]
    np.testing.assert_allclose(found, bank(frames)[1](), rtol=1e-9)
    assert np.array_equal(asked[3](), found[:, 3:4])


def test_frames_that_nobody_asks_for_are_not_worked_out(bank, frames, products):
    for frame in frames:
        bank(frame[None])
    bank(frames[:1])[1]()
    assert products == [1]


def test_forgotten_frames_take_no_memory():
    queue = WaitingFrames()
    for _ in range(2 * MOST):
        queue.add(np.ones((1, 1, 1)), np.ones((1, 1, 1)), lambda k, _: k[:, :, 0])
    assert len(queue._frames) <= MOST


def test_a_bank_travels_while_frames_wait(bank, frames):
    waiting = bank(frames[:1])[1]
    other = pickle.loads(pickle.dumps(bank))
    np.testing.assert_allclose(other(frames[:1])[1](), waiting(), rtol=1e-9)
