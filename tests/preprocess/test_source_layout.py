"""Where a source has what a model knows."""

import numpy as np
import pytest

from facert.data.take import Source
from facert.errors import InputError
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


MARKERS = ("LBRO", "RBRO", "CHIN", "NOSE", "LMTH", "RMTH", "JAW1")


@pytest.mark.parametrize("prefix", ["Actor1:", "Kopf|x:", "face_"])
def test_markers_of_a_subject_are_those_of_the_model(prefix, caplog):
    caplog.set_level("INFO")
    layout = SourceLayout("markers", MARKERS)
    theirs = [f"{prefix}{name}" for name in MARKERS[:0:-1]]
    columns = layout.columns(theirs)
    frame = np.arange(18.0).reshape(6, 3)
    expected = np.vstack([np.full((1, 3), np.nan), frame[::-1]])
    np.testing.assert_array_equal(columns.pick(frame.ravel()).reshape(7, 3), expected)
    assert f"names matched without the prefix '{prefix}'" in caplog.text
    assert "taken as not observed, as the take lacks them: LBRO" in caplog.text


def test_markers_of_two_subjects_are_refused_by_name():
    both = [f"Actor{number}:{name}" for number in (1, 2) for name in MARKERS]
    with pytest.raises(InputError, match=r"'Actor1:\*' and 'Actor2:\*'"):
        SourceLayout("markers", MARKERS).columns(both)
    assert len(SourceLayout("markers", tuple(both[7:])).columns(both).absent) == 0
