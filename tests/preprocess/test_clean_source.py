"""A source that is cleaned for mapping says how sure its filled numbers are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.normalisation import Normalisation
from facert.preprocess.clean_source import SourceOptions, clean_source
from facert.preprocess.motion.estimate import estimate
from facert.preprocess.source_layout import SourceLayout


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_the_input_variance_is_that_of_the_estimate_where_nothing_was_measured(
    make_take, unit, monkeypatch
):
    monkeypatch.setattr("facert.preprocess.motion.motion.FACTORS", 4)
    take = make_take(frames=60, posed=0, markers=8)
    values = unit * take.source.values
    values[20:30, 2] = np.nan
    take = replace(take, source=replace(take.source, values=values))
    X, layout = take.source.matrix, SourceLayout("markers", take.source.names)
    units = Normalisation.of(X, "source")
    found = clean_source(take, layout, units, np.zeros(24), SourceOptions(detect=False))
    hidden, own = np.isnan(X), estimate(X, take.time)
    assert (found.input_variance[~hidden] == 0.0).all()
    expected = (own.std / np.nanstd(X, axis=0).max())[hidden] ** 2
    np.testing.assert_allclose(found.input_variance[hidden], expected, rtol=1e-9)
    np.testing.assert_allclose(units.undo(found.clean), own.frames, rtol=1e-6, atol=1e-9 * unit)
    np.testing.assert_array_equal(found.filled[~hidden], found.measured[~hidden])
