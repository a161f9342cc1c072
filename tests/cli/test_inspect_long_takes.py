"""Of a long take `inspect` reads a part, and says how much."""

import json
from dataclasses import replace

import numpy as np
import pytest

from facert.data.facts import facts_of
from facert.data.take import Controls, Source, Take
from facert.io import take_overview
from facert.io.hdf5 import GuardedFile
from facert.io.take import read_take, write_take

FRAMES = 900


@pytest.fixture(name="path", scope="module")
def _path(tmp_path_factory):
    rng = np.random.default_rng(0)
    values, params = rng.normal(size=(FRAMES, 3, 3)), np.full((FRAMES, 2), np.nan)
    values[:, 1] = 1.0
    values[::2, 2] = np.nan
    params[7::50] = rng.normal(size=(18, 2))
    take = Take(
        np.arange(FRAMES) / 60.0,
        Source(values, ("nose", "chin", "brow")),
        Controls(("jawOpen", "smile")),
        params,
        animation=np.ones((5, 2)),
        fps=60.0,
        units="cm",
    )
    path = tmp_path_factory.mktemp("long") / "take.h5"
    write_take(take, path)
    return path


@pytest.fixture(name="short_runs")
def _short_runs(monkeypatch):
    monkeypatch.setattr(take_overview, "RUN", 20)


def test_what_is_shown_is_that_of_the_whole_take(facert, path, short_runs):
    facts = json.loads(facert("inspect", path, "--json").out)
    assert facts["source"].pop("looked_at") == f"80 of {FRAMES} frames"
    assert {**facts, "file": ""} == {
        **json.loads(json.dumps(facts_of(read_take(path)))),
        "file": "",
    }
    shown = facert("inspect", path).out
    assert f"80 of {FRAMES} frames" in shown
    assert "brow 50.0%" in shown


def test_the_source_is_not_read_whole(facert, path, short_runs, monkeypatch):
    read, rows = [], GuardedFile.read_rows
    numbers = GuardedFile.numbers
    monkeypatch.setattr(
        GuardedFile, "numbers", lambda self, at: (read.append(at), numbers(self, at))[1]
    )
    monkeypatch.setattr(
        GuardedFile,
        "read_rows",
        lambda self, dataset, at, start, stop: (
            read.append((at, stop - start)),
            rows(self, dataset, at, start, stop),
        )[1],
    )
    assert facert("inspect", path).code == 0
    assert "/source/markers" not in read
    assert [one for one in read if one[0] == "/source/markers"] == [("/source/markers", 20)] * 4


def test_a_short_take_and_one_whose_sample_shows_nothing_are_read_whole(facert, path, tmp_path):
    assert "looked at" not in facert("inspect", path).out
    take = read_take(path)
    values = np.full_like(take.source.values, np.nan)
    values[100] = 1.0
    write_take(replace(take, source=replace(take.source, values=values)), tmp_path / "gaps.h5")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(take_overview, "RUN", 20)
        shown = facert("inspect", tmp_path / "gaps.h5")
    assert shown.code == 0
    assert "looked at" not in shown.out
