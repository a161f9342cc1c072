"""What a take is learned from: how much noise is left, and in which units motion is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.preprocess.preparation import prepare, training_data
from facert.settings import Settings


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Few factors suffice for what moves in two dimensions."""
    monkeypatch.setattr("facert.preprocess.motion.motion.FACTORS", 4)


@pytest.fixture(scope="module")
def noisy(make_take):
    """A take with noise and a gap."""
    take = make_take(frames=60, posed=12, markers=8)
    rng, values = np.random.default_rng(0), take.source.values
    values = values + 0.05 * values.std() * rng.normal(size=values.shape)
    values[20:30, 2] = np.nan
    return replace(take, source=replace(take.source, values=values))


def test_about_a_third_of_the_noise_is_left_in_frames_to_learn_from(noisy):
    """None would let a method read much into motion as small as the noise."""
    prepared = prepare(noisy, Settings())
    clean, given = prepared.estimate.frames, prepared.measured.matrix
    seen, learned = ~np.isnan(given), prepared.take.source.matrix
    noise = (given - clean)[seen]
    left = noise @ (learned - clean)[seen] / (noise @ noise)
    assert 0.2 < left < 0.45
    np.testing.assert_allclose((learned - clean)[seen], left * noise, atol=1e-9)
    np.testing.assert_allclose(learned[~seen], clean[~seen])


def test_the_step_from_frame_to_frame_is_in_normalised_units(noisy):
    """σ_t of Eq. (14); of frames whose motion is known, that of the marker that moves most."""
    large = replace(noisy, source=replace(noisy.source, values=1000.0 * noisy.source.values))
    step, of_large = (training_data(take, Settings()).step for take in (noisy, large))
    assert of_large == pytest.approx(step, rel=1e-3)
    prepared = prepare(noisy, Settings())
    motion = np.sqrt(np.mean(np.diff(prepared.estimate.frames, axis=0) ** 2, axis=0)).max()
    largest = np.nanstd(prepared.measured.matrix, axis=0).max()
    assert step == pytest.approx(motion / largest, rel=0.01)
