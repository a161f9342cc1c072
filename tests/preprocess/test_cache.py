import numpy as np
import pytest

from facert.preprocess.cache import KEPT, keep_last
from facert.preprocess.faults import find_faults
from facert.preprocess.motion.estimate import estimate


@pytest.fixture
def counted():
    calls = []

    @keep_last
    def total(values, scale=1.0):
        calls.append(values)
        return scale * values.sum()

    return total, calls


def test_the_same_contents_are_worked_out_once(counted):
    total, calls = counted
    assert total(np.arange(3.0)) == total(np.arange(3.0)) == 3.0
    assert len(calls) == 1


def test_other_contents_are_worked_out_anew(counted):
    total, calls = counted
    values = np.arange(3.0)
    assert total(values) == 3.0
    values[0] = 5.0  # the same array, changed in place
    assert total(values) == 8.0
    assert total(values, scale=2.0) == 16.0
    assert len(calls) == 3


def test_a_few_takes_that_are_learned_from_in_turn_are_worked_out_once(counted):
    total, calls = counted
    for _ in range(3):
        for size in range(1, KEPT + 1):
            assert total(np.ones(size)) == size
    assert len(calls) == KEPT
    total(np.ones(KEPT + 1))
    total(np.ones(2))
    assert len(calls) == KEPT + 1
    total(np.ones(1))  # what was not asked for the longest is forgotten
    assert len(calls) == KEPT + 2


def test_large_takes_are_not_kept_beside_each_other(counted, monkeypatch):
    total, calls = counted
    monkeypatch.setattr("facert.preprocess.cache.MOST_BYTES", 100)
    for _ in range(2):
        total(np.ones(20)), total(np.ones(20)), total(np.ones(10))
    assert len(calls) == 4


def test_an_error_is_not_kept():
    failing = iter([True, False])

    @keep_last
    def sometimes(x):
        if next(failing):
            raise ValueError
        return x

    with pytest.raises(ValueError):
        sometimes(1)
    assert sometimes(1) == 1


def test_a_take_is_cleaned_once_for_training_and_retargeting(make_take):
    take = make_take()
    again = take.source.matrix.copy()
    first = estimate(take.source.matrix, take.time)
    assert estimate(again, take.time.copy()) is first
    assert estimate(again, take.time, 0.1) is not first


def test_nobody_can_change_what_is_kept(make_take):
    take = make_take()
    found, faults = estimate(take.source.matrix, take.time), find_faults(take.source)
    for array in (found.frames, found.std, found.given, faults.zero, faults.spiked):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
