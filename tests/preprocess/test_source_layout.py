"""Where a source has what a model knows."""

import numpy as np
import pytest

from facert.data.take import Source
from facert.preprocess.source_layout import SourceLayout

NAMES = tuple("abcdefg")


@pytest.mark.parametrize("kind", ["markers", "weights"])
@pytest.mark.parametrize("theirs", ["abcdefg", "gxfedcbya", "bdacf"])
def test_a_source_is_brought_into_the_order_of_the_model(kind, theirs):
    shape = (5, len(theirs), 3) if kind == "markers" else (5, len(theirs))
    values = np.random.default_rng(0).normal(size=shape)
    values[0, 2] = np.nan
    source, layout = Source(values, tuple(theirs)), SourceLayout(kind, NAMES)
    arranged = layout.arrange(source)
    assert arranged.names == NAMES
    for column, name in enumerate(NAMES):
        expected = values[:, theirs.index(name)] if name in theirs else np.nan
        np.testing.assert_array_equal(arranged.values[:, column], expected)
    columns = layout.columns(theirs)
    rows = np.array([columns.pick(frame.ravel()) for frame in values])
    np.testing.assert_array_equal(rows, arranged.matrix)
