"""A source that is cleaned for mapping says how sure its filled numbers are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.normalisation import Normalisation
from facert.data.take import Source, Take
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


def warnings_of(given, trained, caplog) -> list[str]:
    """What is warned of where weights are given to what was trained on others."""
    names = [f"w{i}" for i in range(given.shape[1])]
    take, layout = (
        Take(np.arange(len(given)) / 30.0, Source(given, names)),
        SourceLayout("weights", tuple(names)),
    )
    caplog.clear()
    units = Normalisation.of(trained, "/source")
    clean_source(take, layout, units, trained.mean(axis=0), SourceOptions(smooth=False))
    return [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]


def test_percent_given_for_fractions_is_named_in_one_sentence(caplog):
    rng = np.random.default_rng(0)
    heights = rng.uniform(0.02, 1.0, 20)
    trained, given = (heights * rng.random((200, 20)) ** 2 for _ in range(2))
    trained[:, 7] = given[:, 7] = 0.0
    found = warnings_of(100.0 * given, trained, caplog)
    assert len(found) == 1
    assert "about 100 times as large as in training: percent" in found[0]
    found = warnings_of(given, 100.0 * trained, caplog)
    assert len(found) == 1
    assert "a hundredth of those in training: fractions" in found[0]
    quiet, absurd, turned = 0.01 * trained, given.copy(), given.copy()
    absurd[20, 3] = 1e6
    turned[:, 2] = 40.0 * np.sin(np.arange(200) / 30.0)
    for weights, base in (
        (given, trained),
        (100.0 * given, 100.0 * trained),
        (given, quiet),
        (quiet, trained),
        (turned, trained),
        (absurd, trained),
    ):
        assert "percent" not in " ".join(warnings_of(weights, base, caplog))
