"""Where a source has what a model knows."""

import numpy as np
import pytest

from facert.preprocess.source_layout import FramePicker, SourceLayout

NAMES = tuple("abcdefg")


@pytest.mark.parametrize("kind", ["markers", "weights"])
@pytest.mark.parametrize("theirs", ["abcdefg", "gxfedcbya", "bdacf"])
def test_frame_by_frame_the_same_is_picked_as_of_all_frames(kind, theirs):
    shape = (5, len(theirs), 3) if kind == "markers" else (5, len(theirs))
    values = np.random.default_rng(0).normal(size=shape)
    values[0, 2] = np.nan
    places = SourceLayout(kind, NAMES).places(theirs)
    picker = FramePicker(places, len(theirs), 3 if kind == "markers" else 1)
    rows = np.array([picker.pick(frame) for frame in values])
    np.testing.assert_array_equal(rows, places.pick(values).reshape(5, -1))


def test_a_picked_frame_stays_when_the_next_is_picked():
    picker = FramePicker(SourceLayout("weights", NAMES).places(NAMES), 7, 1)
    first = picker.pick(np.arange(7.0))
    picker.pick(np.zeros(7))
    np.testing.assert_array_equal(first, np.arange(7.0))
