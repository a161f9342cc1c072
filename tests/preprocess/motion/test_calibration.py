"""Standard deviations of what was hidden, against errors that are known."""

import numpy as np
import pytest

from facert.data.arrays import rms
from facert.preprocess.motion.estimate import RANGE, error_of_filling, estimate
from facert.preprocess.motion.motion import Motion

FRAMES, COLUMNS = 400, 24


def moving(seed=0, own=0.0):
    """Smooth frames of four factors, and what each group of three columns does of its own."""
    rng = np.random.default_rng(seed)
    time = np.arange(FRAMES)[:, None] / 30.0
    shared = np.sin(time * rng.uniform(1.0, 5.0, 4) + rng.uniform(0.0, 6.0, 4))
    groups = np.sin(
        time * rng.uniform(3.0, 9.0, COLUMNS // 3) + rng.uniform(0.0, 6.0, COLUMNS // 3)
    )
    frames = shared @ rng.normal(size=(4, COLUMNS)) + own * np.repeat(groups, 3, axis=1)
    return frames / frames.std(axis=0).max()


def hide(frames, seed=1):
    """The same with groups hidden for a second each."""
    rng = np.random.default_rng(seed)
    hidden = np.zeros(frames.shape, dtype=bool)
    for start in range(0, FRAMES - 30, 60):
        group = 3 * rng.integers(COLUMNS // 3 - 1)
        hidden[start : start + 30, group : group + 6] = True
    return np.where(hidden, np.nan, frames), hidden


@pytest.mark.parametrize("own", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("noise", [0.001, 0.05])
def test_errors_are_predicted_within_a_factor_of_two(own, noise):
    truth = moving(own=own)
    given, hidden = hide(truth + noise * np.random.default_rng(2).normal(size=truth.shape))
    found = estimate(given, np.arange(FRAMES) / 30.0)
    error, predicted = rms((found.frames - truth)[hidden]), rms(found.std[hidden])
    assert 0.5 < predicted / error < 2.0


def test_where_hidden_groups_move_on_their_own_the_model_alone_is_too_sure():
    given, hidden = hide(moving(own=1.0))
    found = estimate(given, np.arange(FRAMES) / 30.0)
    assert rms(found.std[hidden]) > 1.3 * rms(found.spread[hidden])
    np.testing.assert_array_equal(found.std[~hidden], found.spread[~hidden])


def test_without_gaps_or_with_few_nothing_is_calibrated():
    frames = moving()
    assert error_of_filling(frames, 0.001, 1.0 / 30.0) == 1.0
    frames[5, :3] = np.nan
    assert error_of_filling(frames, 0.001, 1.0 / 30.0) == 1.0


def test_it_is_the_same_by_another_seed_of_noise_and_within_its_range():
    truth = moving(own=0.5)
    ratios = []
    for seed in range(2):
        noisy = truth + 0.02 * np.random.default_rng(seed).normal(size=truth.shape)
        ratios.append(error_of_filling(hide(noisy)[0], 0.02, 1.0 / 30.0))
    assert ratios[0] == pytest.approx(ratios[1], rel=0.25)
    assert RANGE[0] <= min(ratios) <= max(ratios) <= RANGE[1]


def test_a_column_that_its_gaps_and_their_echo_would_hide_throughout_is_left_as_it_is():
    given, _ = hide(moving())
    given[: FRAMES // 2, :3] = np.nan  # half a take later is the other half
    assert np.isfinite(error_of_filling(given, 0.001, 1.0 / 30.0))


def test_the_ratio_is_that_of_errors_where_gaps_are_made_once_more_half_a_take_later(monkeypatch):
    """To the standard deviation there, by a motion that does not know; without the noise."""
    monkeypatch.setattr("facert.preprocess.motion.motion.FACTORS", 4)
    noise = 0.05
    truth = moving(own=1.0)
    X, hidden = hide(truth + noise * np.random.default_rng(2).normal(size=truth.shape))
    again = np.roll(hidden, FRAMES // 2, axis=0) & ~hidden
    given = np.where(again, np.nan, X)
    mean, variance = Motion.learned(given, noise).smooth(given, noise)
    ratio = np.sqrt((rms((mean - X)[again]) ** 2 - noise**2) / variance[again].mean())
    assert ratio > 1.3
    assert error_of_filling(X, noise, 1.0) == pytest.approx(ratio)
