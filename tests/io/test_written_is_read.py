"""Whatever facert writes, facert reads: extreme numbers, limits without an end, long names."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from facert.data.take import Controls, Corrections, Source, Take
from facert.errors import InputError
from facert.evaluation.cells import Cell, Outcome
from facert.evaluation.metrics import Scores
from facert.io.formats import read_take_file, write_take_file
from facert.io.journal import Journal
from facert.models.optim.monitor import Progress
from facert.models.optim.optimiser import State
from facert.retarget.checkpoint import CheckpointFile

ENDINGS = (".h5", ".csv", ".json", ".curvetable.csv", ".curvetable.json")
EXTREMES = (0.0, -0.0, 5e-324, 1e-300, 1.0, 1e15, 1e30, 1e100, 1.7e308)
numbers = st.sampled_from(EXTREMES) | st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")), max_size=300)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("written")


@settings(deadline=None, max_examples=40)
@given(st.sampled_from(ENDINGS), st.lists(numbers, min_size=8, max_size=8), st.booleans(), texts)
@example(".h5", [1e12] * 8, True, "a" * 4096)
@example(".csv", [1.797693134862e308] * 8, False, "")
@example(".json", [1e-320] * 8, False, "=1")
def test_takes_of_extreme_numbers_come_back(folder, ending, values, as_poses, text):
    name = text.strip() or "a"
    matrix = np.array(values).reshape(4, 2)
    source = Source(matrix, (name, "second"))
    if as_poses:
        limits = [[-np.inf, np.inf], [-1.7e308, np.inf]]
        try:
            take = Take(
                np.arange(4) / 30, source, Controls(source.names, limits), matrix, model=text
            )
        except InputError:
            return
    else:
        take = Take(np.arange(4) / 30, source)
    path = folder / f"take{ending}"
    try:
        write_take_file(take, path, overwrite=True)
    except InputError:  # that it cannot be written is said before
        return
    found = read_take_file(path)
    read = found.params if ending == ".h5" and as_poses else found.source.values
    np.testing.assert_allclose(read, matrix, rtol=1e-8)
    if ending == ".h5" and as_poses:
        np.testing.assert_array_equal(found.controls.limits, take.controls.limits)
        assert (found.controls.names, found.model) == (take.controls.names, text)


def test_corrections_without_limits_come_back(folder):
    params = np.arange(8.0).reshape(4, 2) * 1e290
    fixed = Corrections(np.array([1]), params[1:2], np.array([0.5]))
    take = Take(np.arange(4) / 30, Source(params, "ab"), Controls("ab"), params, corrections=fixed)
    write_take_file(take, folder / "corrected.h5")
    np.testing.assert_array_equal(
        read_take_file(folder / "corrected.h5").corrections.params, fixed.params
    )


@settings(deadline=None, max_examples=25)
@given(numbers, st.lists(numbers, max_size=3), texts)
def test_outcomes_come_back_from_their_journal(folder, number, more, text):
    path = folder / "cells.jsonl"
    path.unlink(missing_ok=True)
    cell = Cell(text, 3, 2**40, 0)
    outcome = Outcome(cell, Scores(number, tuple(more), 1.0, None, number), number, failure=text)
    journal = Journal(path, text)
    journal.begin()
    journal.add(outcome.as_dict())
    assert [Outcome.from_dict(entry) for entry in Journal(path, text).begin()] == [outcome]


@pytest.mark.parametrize(
    "damage",
    [
        {"cell": {"method": "a"}},
        {"scores": [[]]},
        {"fit_seconds": "1"},
        {"more": 1},
        {"cell": None},
    ],
)
def test_a_damaged_entry_of_a_journal_is_an_input_error(damage):
    outcome = json.loads(json.dumps(Outcome(Cell("a", 1, 1, 1)).as_dict()))
    with pytest.raises(InputError, match="the outcome"):
        Outcome.from_dict(outcome | damage)


@settings(deadline=None, max_examples=25)
@given(st.lists(numbers, min_size=1, max_size=5), st.lists(numbers, max_size=3), texts)
def test_checkpoints_come_back(folder, x, curve, fingerprint):
    memory = {"gradient": np.array(x), "direction": np.array(x), "scalars": np.ones(2)}
    progress = Progress(State(np.array(x), x[0], 1e300, 2**40, memory), tuple(curve))
    file = CheckpointFile(folder / "a.checkpoint.safetensors", resume=True)
    file.path.unlink(missing_ok=True)
    file.resume(fingerprint)
    file.checkpoint(progress)
    found = CheckpointFile(file.path, resume=True).resume(fingerprint)
    assert found is not None
    assert found.curve == progress.curve
    assert replace(found.state, x=0, memory={}) == replace(progress.state, x=0, memory={})
    np.testing.assert_array_equal(found.state.x, x)


def test_a_text_that_would_not_fit_is_refused_before_it_is_made(tmp_path, monkeypatch) -> None:
    take = Take(np.arange(4000) / 30, Source(np.zeros((4000, 100)), [f"w{i}" for i in range(100)]))
    monkeypatch.setenv("FACERT_MAX_MEMORY", "10M")
    with pytest.raises(InputError, match="output: expected at most 10 MiB of memory"):
        write_take_file(take, tmp_path / "take.csv")
    assert not list(tmp_path.iterdir())
    write_take_file(take, tmp_path / "take.h5")
