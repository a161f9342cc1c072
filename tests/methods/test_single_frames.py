"""A frame alone gets what it gets in a batch, and processes together what each gets alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.data.normalisation import Normalisation
from facert.methods.base import Labelled, Unlabelled
from facert.methods.processes import ProcessBank
from facert.methods.registry import make_method
from facert.settings import Settings

EXACT = 1e-12


@pytest.fixture(scope="module")
def problem():
    """Labels, unlabelled data and new frames; some poses pile up at 0, others at 1."""
    rng = np.random.default_rng(3)
    Z = rng.normal(size=(400, 6))
    X = Z @ rng.normal(size=(6, 24)) / 2.5 + 0.1 * rng.normal(size=(400, 24))
    Y = np.clip(np.tanh(Z @ rng.normal(size=(6, 9)) / 2.5), -0.3, 0.6)
    return Labelled(X[:14], Y[:14]), Unlabelled(X[14:200], Y[200:300]), X[300:]


def fitted(name, problem):
    method = make_method(Settings(method=name))
    method.fit(*problem[:2])
    return method


@pytest.fixture(scope="module")
def blend(problem):
    return fitted("auto", problem).map_


def assert_rows_are_the_batch(map_, frames, atol=EXACT):
    """That a map predicts for each frame alone what it predicts for all at once."""
    Y, variance = map_(frames)
    for x, pose, spread in zip(frames, Y, variance(), strict=True):
        alone, own = map_(x[None])
        np.testing.assert_allclose(alone[0], pose, atol=atol)
        np.testing.assert_allclose(own()[0], spread, atol=atol)


@pytest.mark.parametrize("name", ["auto", "ssgpr", "gpr", "gpr-linear"])
def test_one_frame_after_the_other_is_the_batch(name, problem):
    map_ = fitted(name, problem).map_
    assert_rows_are_the_batch(map_, problem[2])


@pytest.mark.parametrize("weights", [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0.3, 0.7]])
def test_experts_without_weight_may_be_left_out(blend, problem, weights):
    some = replace(blend, weights=np.array(weights, dtype=float))
    assert_rows_are_the_batch(some, problem[2][:30])


def test_processes_share_features_only_where_they_are_the_same(blend, problem):
    frames = problem[2][:20]
    moved = replace(blend.residual, centre=blend.residual.centre + 0.1)
    bank = ProcessBank([blend.plain, blend.whitened, blend.residual, moved])
    assert len(bank._features) == 3
    expected = [alone(p, frames) for p in (blend.plain, blend.whitened, blend.residual, moved)]
    poses, variances = bank(frames)
    np.testing.assert_allclose(poses, [Y for Y, _ in expected], atol=EXACT)
    np.testing.assert_allclose(variances(), [variance for _, variance in expected], atol=EXACT)


def alone(process, frames):
    """Mean and variance of a process by the formulas of Rasmussen and Williams (2006), (2.25)."""
    given, kernel = process.process, process.process.kernel
    features = (frames - process.centre) @ process.basis
    k = kernel.cross(features, given.X)
    solved = np.linalg.solve(kernel.gram(given.X), k.T)
    variance = kernel.noise + kernel.prior_variance(features) - np.sum(k.T * solved, axis=0)
    return process.mean + solved.T @ given.Y, variance


def test_limits_take_from_factors_what_they_do_in_a_batch(blend, problem):
    factors = blend.factors
    assert 0 < factors.censored.sum() < factors.censored.size
    expected = factors(problem[2])[0]
    np.testing.assert_allclose([factors(x[None])[0][0] for x in problem[2]], expected, atol=1e-12)


def test_far_off_frames_are_no_special_case(blend, problem):
    far = 100.0 * problem[2][:5]
    assert_rows_are_the_batch(blend, far, atol=1e-7)


@pytest.mark.parametrize("name", ["auto", "ssgpr", "ridge", "svr"])
def test_gaps_and_input_variance_mean_the_same_in_a_stream(name, problem):
    method, rng = fitted(name, problem), np.random.default_rng(0)
    frames = problem[2][:20]
    hidden = np.where(rng.random(frames.shape) < 0.2, np.nan, frames)
    variance = rng.random(frames.shape)
    for X, R in ((frames, None), (hidden, None), (frames, variance)):
        expected, stream = method.predict(X, R), method.stream()
        for row in range(len(X)):
            streamed = stream.step(X[row : row + 1], None if R is None else R[row : row + 1])
            np.testing.assert_allclose(streamed.Y[0], expected.Y[row], atol=EXACT)
            np.testing.assert_allclose(streamed.X[0], expected.X[row], atol=EXACT)
            assert (streamed.std is None) == (expected.std is None)
            if streamed.std is not None:
                np.testing.assert_allclose(streamed.std[0], expected.std[row], atol=EXACT)


def test_a_std_that_is_asked_for_late_is_that_of_its_own_frame(problem):
    method, frames = fitted("auto", problem), problem[2][:10]
    stream = method.stream()
    streamed = [stream.step(frame[None]) for frame in frames]
    std = [one.std[0] for one in reversed(streamed)]
    np.testing.assert_allclose(std[::-1], method.predict(frames).std, atol=EXACT)


@pytest.mark.real
@pytest.mark.parametrize("target", ["arkit", "units"])
def test_on_a_recording(real_data, target):
    take = facert.read_take(real_data / "tracks" / "rom.npz", target=target)
    X, Y = take.source.matrix, take.params
    X, Y = Normalisation.of(X, "x").apply(X), Normalisation.of(Y, "y").apply(Y)
    rows = np.random.default_rng(0).permutation(len(X))
    problem = Labelled(X[rows[:20]], Y[rows[:20]]), Unlabelled(X[rows[20:120]], Y[rows[120:180]])
    map_ = fitted("auto", problem).map_
    assert_rows_are_the_batch(map_, X[rows[-200:]])
