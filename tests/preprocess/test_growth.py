"""Cleaning takes memory and work in proportion to markers and to frames."""

from __future__ import annotations

import tracemalloc
from unittest import mock

import numpy as np

from facert.data.take import Source
from facert.preprocess.faults import find_faults
from facert.preprocess.motion import motion_factors
from facert.preprocess.motion.estimate import estimate
from facert.preprocess.motion.motion_factors import fill_by_factors


def crowd(markers: int, frames: int, gaps: float = 0.0) -> np.ndarray:
    """Markers on a plane that some smooth factors move, (T, M, 3)."""
    rng = np.random.default_rng(0)
    places = 100.0 * rng.random((markers, 3))
    near = [np.exp(-((places - one) ** 2).sum(axis=1) / 2000.0) for one in places[:6]]
    factors = np.sin(np.arange(frames)[:, None] * rng.uniform(0.1, 0.3, 6) + np.arange(6))
    ways = np.stack(near)[:, :, None] * rng.normal(size=(6, 1, 3))
    found = places + np.einsum("tk,kmi->tmi", factors, ways)
    found += 0.01 * rng.normal(size=found.shape)
    found[rng.random(found.shape[:2]) < gaps] = np.nan
    return found


def peak(work: object) -> int:
    """Bytes that a function takes at most, beyond what is there."""
    tracemalloc.start()
    try:
        assert callable(work)
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def cleaned(X: np.ndarray) -> None:
    find_faults(Source(X, [f"m{i}" for i in range(X.shape[1])]))
    estimate(X.reshape(len(X), -1), np.arange(len(X)) / 60.0)


def test_memory_of_cleaning_grows_with_the_markers_and_no_faster() -> None:
    few, many = (crowd(markers, 16, 0.01) for markers in (400, 1200))
    small, large = (peak(lambda X=X: cleaned(X)) for X in (few, many))
    assert large < 3.5 * small


def test_memory_of_cleaning_grows_with_the_frames_and_no_faster() -> None:
    short, long = (crowd(6, frames) for frames in (300, 900))
    small, large = (peak(lambda X=X: cleaned(X)) for X in (short, long))
    assert large < 3.2 * small


def test_factors_of_four_times_the_columns_multiply_no_more_than_four_times_as_much() -> None:
    work = []
    for markers in (400, 1600):
        X = crowd(markers, 40).reshape(40, -1)
        with mock.patch.object(
            motion_factors, "_products", wraps=motion_factors._products
        ) as products:
            motion_factors.MotionFactors.learned(
                X, X[:, motion_factors.part_of(X.shape[1])], 0.1, 8
            )
        work.append(sum(call.args[0].shape[0] for call in products.call_args_list))
    assert work[1] < 4.0 * work[0]


def test_gaps_of_very_many_columns_are_filled_by_factors_of_all() -> None:
    truth = crowd(300, 60).reshape(60, -1)
    hidden = np.random.default_rng(1).random(truth.shape) < 0.02
    filled = fill_by_factors(np.where(hidden, np.nan, truth))
    np.testing.assert_array_equal(filled[~hidden], truth[~hidden])
    assert np.sqrt(np.mean((filled - truth)[hidden] ** 2)) < 0.03
    assert fill_by_factors(truth) is truth
