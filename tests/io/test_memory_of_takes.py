"""Long takes are read and written with little memory beside their own."""

import tracemalloc
from contextlib import contextmanager

import numpy as np
import pytest

from facert.data.arrays import float_array, frozen
from facert.data.take import Controls, Source, Take
from facert.io.take import read_take, write_take

FRAMES, MARKERS, CONTROLS = 4000, 30, 20
OWN = 8 * FRAMES * (1 + 3 * MARKERS + CONTROLS)


@pytest.fixture(name="take", scope="module")
def _take():
    rng = np.random.default_rng(0)
    return Take(
        np.arange(FRAMES) / 60.0,
        Source(rng.integers(9, size=(FRAMES, MARKERS, 3)), tuple(map(str, range(MARKERS)))),
        Controls(tuple(map(str, range(CONTROLS)))),
        rng.integers(9, size=(FRAMES, CONTROLS)),
    )


@contextmanager
def most_memory(most):
    """Fail where the block holds more bytes at a time than it began with."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < most
    finally:
        tracemalloc.stop()


def test_reading_and_writing_take_little_more_than_the_take_itself(take, tmp_path):
    write_take(take, tmp_path / "first.h5")
    with most_memory(1.5 * OWN):
        read = read_take(tmp_path / "first.h5")
    with most_memory(0.8 * OWN):
        write_take(read, tmp_path / "second.h5")
    np.testing.assert_array_equal(read.source.values, take.source.values)


def test_what_nobody_changes_is_shared_and_anything_else_copied():
    mine = np.ones((3, 2))
    assert not np.shares_memory(float_array(mine, "x"), mine)
    read_only = frozen(mine.view())
    assert not np.shares_memory(float_array(read_only, "x"), mine)
    whole, part = frozen(np.ones((3, 2))), frozen(np.ones((9, 2)))[:3]
    assert float_array(whole, "x") is whole
    assert np.shares_memory(float_array(whole.reshape(2, 3), "x"), whole)
    assert not np.shares_memory(float_array(part, "x"), part)


def test_a_marker_that_is_seen_in_part_is_hidden_in_a_copy():
    values = np.ones((2, 2, 3))
    values[1, 0, 2] = np.nan
    shared = frozen(values)
    source = Source(shared, ("a", "b"))
    assert np.isnan(source.values[1, 0]).all()
    assert np.isnan(shared).sum() == 1
    assert Source(source.values, ("a", "b")).values is source.values
