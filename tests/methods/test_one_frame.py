"""Maps for single frames say what maps for batches say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.data.normalisation import Normalisation
from facert.methods.base import Labelled, Unlabelled
from facert.methods.one_frame import BlendFrame, FactorFrame, ProcessBank
from facert.methods.registry import make_method
from facert.settings import Settings

EXACT = 1e-10


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


def assert_says(one, map_, frames, atol=EXACT):
    """That `one` says of each frame what `map_` says of all."""
    Y, std = map_(frames)
    for x, pose, spread in zip(frames, Y, std, strict=True):
        said, tell = one(x)
        np.testing.assert_allclose(said, pose, atol=atol)
        np.testing.assert_allclose(np.sqrt(tell()), spread, atol=atol)


@pytest.mark.parametrize("name", ["auto", "ssgpr", "gpr", "gpr-linear"])
def test_one_frame_after_the_other_is_the_batch(name, problem):
    map_ = fitted(name, problem).map_
    assert_says(map_.for_frames, map_, problem[2])


@pytest.mark.parametrize("weights", [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0.3, 0.7]])
def test_experts_without_weight_may_be_left_out(blend, problem, weights):
    some = replace(blend, weights=np.array(weights, dtype=float))
    assert_says(BlendFrame(some), some, problem[2][:30])


def test_processes_share_features_only_where_they_are_the_same(blend, problem):
    frames = problem[2][:20]
    moved = replace(blend.residual, centre=blend.residual.centre + 0.1)
    bank = ProcessBank([blend.plain, blend.whitened, blend.residual, moved])
    assert len(bank._features) == 3
    expected = [p(frames) for p in (blend.plain, blend.whitened, blend.residual, moved)]
    for row, x in enumerate(frames):
        told = bank(x)
        np.testing.assert_allclose(told.poses, [Y[row] for Y, _ in expected], atol=EXACT)
        std = np.sqrt(bank.variances(told))
        np.testing.assert_allclose(std, [s[row, 0] for _, s in expected], atol=EXACT)


def test_limits_take_from_factors_what_they_do_in_a_batch(blend, problem):
    factors = blend.factors
    assert 0 < factors.censored.sum() < factors.censored.size
    one, expected = FactorFrame(factors), factors(problem[2])[0]
    np.testing.assert_allclose([one(x) for x in problem[2]], expected, atol=1e-12)


def test_far_off_frames_are_no_special_case(blend, problem):
    far = 100.0 * problem[2][:5]
    assert_says(BlendFrame(blend), blend, far, atol=1e-7)


@pytest.mark.parametrize("name", ["auto", "ssgpr", "ridge", "svr"])
def test_gaps_and_doubt_mean_the_same_in_a_stream(name, problem):
    method, rng = fitted(name, problem), np.random.default_rng(0)
    frames = problem[2][:20]
    hidden = np.where(rng.random(frames.shape) < 0.2, np.nan, frames)
    doubt = rng.random(frames.shape)
    for X, R in ((frames, None), (hidden, None), (frames, doubt)):
        expected, stream = method.predict(X, R), method.stream()
        for row in range(len(X)):
            said = stream.step(X[row : row + 1], None if R is None else R[row : row + 1])
            np.testing.assert_allclose(said.Y[0], expected.Y[row], atol=EXACT)
            np.testing.assert_allclose(said.X[0], expected.X[row], atol=EXACT)
            assert (said.std is None) == (expected.std is None)
            if said.std is not None:
                np.testing.assert_allclose(said.std[0], expected.std[row], atol=EXACT)


def test_a_std_that_is_asked_for_late_is_that_of_its_own_frame(problem):
    method, frames = fitted("auto", problem), problem[2][:10]
    stream = method.stream()
    said = [stream.step(frame[None]) for frame in frames]
    std = [one.std[0] for one in reversed(said)]
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
    assert_says(map_.for_frames, map_, X[rows[-200:]])
