import json
import logging
import resource
from dataclasses import replace
from itertools import islice
from multiprocessing import active_children

import numpy as np
import pytest

import facert
from facert.data.arrays import rms
from facert.data.rig import Rig
from facert.errors import InputError
from facert.evaluation.cells import Cell, Outcome, cell_settings, evaluate
from facert.evaluation.protocol import (
    Protocol,
    draw,
    held_out_take,
    make_problem,
    training_take,
    true_poses,
)
from facert.evaluation.run import Grid, fingerprint, run
from facert.io.journal import Journal
from facert.methods.registry import REGISTRY
from facert.retarget.options import AS_IT_IS

GRID = Grid(methods=("nearest", "ridge"), labels=(4, 6), unlabelled=(10,), repeats=2)


def scores(outcomes):
    return {outcome.cell: outcome.scores for outcome in outcomes}


def test_a_cell_equals_a_direct_computation(make, quick):
    problem, cell = make(noise=0.05), Cell("ssgplvm", 8, 10, 1)
    chosen = draw(problem, 8, 10, 1)
    retargeter = facert.train(
        training_take(problem, chosen, 1), cell_settings(problem, cell, quick)
    )
    result = retargeter.retarget(held_out_take(problem, chosen, 1), options=AS_IT_IS)
    outcome = evaluate(problem, cell, quick)
    assert outcome.scores.rms == rms(result.params - true_poses(problem, chosen))
    assert outcome.fit_seconds > 0
    assert outcome.frame_ms > 0


def test_labels_and_unlabelled_data_of_the_draw_are_all_used(make, quick):
    problem, cell = make(), Cell("ssgplvm", 8, 10, 0)
    take = training_take(problem, draw(problem, 8, 10, 0), 0)
    figures = facert.train(take, cell_settings(problem, cell, quick)).figures
    counts = [figures[name] for name in ("labelled frames", "unlabelled frames")]
    assert [*counts, figures["unlabelled poses"]] == [8, 10, 10]


def test_a_rig_gives_errors_of_vertices(make_take, quick):
    take = make_take(frames=60, posed=60, animation=0)
    shapes = np.random.default_rng(0).normal(size=(4, 7, 3))
    rig = Rig(np.zeros((7, 3)), shapes, take.controls.names, np.array([[0, 1, 2]]))
    problem = make_problem(take, Protocol(), rig=rig)
    found = evaluate(problem, Cell("ridge", 6, 5, 0), quick).scores
    assert 0 < found.vertex_rms < found.vertex_p95


def test_a_method_that_cannot_run_gives_the_reason_and_the_others_go_on(make, quick):
    grid = Grid(("ridge",), labels=(2, 5), unlabelled=(5,), repeats=1)
    few, enough = run(make(), grid, quick)
    assert few.scores is None
    assert "at least 3 posed frames" in few.failure
    assert enough.scores is not None


def test_an_unexpected_error_fails_its_cell_and_is_tried_again(
    make, quick, tmp_path, caplog, monkeypatch
):
    monkeypatch.setitem(REGISTRY, "broken", ("linear", "NoSuchClass"))
    journal = Journal(tmp_path / "cells.jsonl", "")
    with caplog.at_level(logging.DEBUG, "facert"):
        broken, ridge = run(make(), Grid(("broken", "ridge"), (5,), (5,), 1), quick, 1, journal)
    assert broken.failure.startswith("unexpected AttributeError: module 'facert.methods.linear'")
    assert "Traceback" in caplog.text
    assert ridge.scores is not None
    assert [Outcome.from_dict(entry) for entry in journal.begin()] == [ridge]


def test_both_halves_of_a_split_by_blocks_must_do(make, make_take, quick):
    take = make_take(frames=120, posed=120, animation=0)
    params = take.params.copy()
    params[12:24] = params[36:48] = np.nan  # of the second half alone
    problem = make(replace(take, params=params), split="block")
    grid = Grid(("ridge",), (50,), (0,), repeats=2)
    with pytest.raises(InputError, match=r"posed frames for 50 labels, .* found 36 to draw from"):
        next(run(problem, grid, quick))


def test_too_short_a_take_is_refused_before_anything_runs(make, quick, tmp_path):
    journal = Journal(tmp_path / "cells.jsonl", "")
    with pytest.raises(InputError, match="fewer labels"):
        next(run(make(), Grid(("ridge",), (5, 110), (10,), 1), quick, journal=journal))
    assert not journal.path.exists()


@pytest.mark.slow
def test_outcomes_do_not_depend_on_the_number_of_processes(make, quick):
    here, there = (scores(run(make(), GRID, quick, jobs)) for jobs in (1, 2))
    assert here == there
    assert set(here) == set(GRID.cells)


@pytest.mark.slow
def test_processes_end_with_an_interrupted_run(make, quick):
    outcomes = run(make(), GRID, quick, jobs=2)
    next(outcomes)
    outcomes.close()
    assert not active_children()


def test_an_interrupted_run_continues_and_computes_nothing_twice(make, quick, tmp_path):
    problem = make()
    journal = Journal(tmp_path / "cells.jsonl", fingerprint(problem, quick))
    first = list(islice(run(problem, GRID, quick, journal=journal), 3))
    with journal.path.open("a") as file:
        file.write('{"cell": {"meth')  # the line that was being written

    outcomes = list(run(problem, GRID, quick, journal=journal))
    assert outcomes[:3] == first  # times included: nothing was computed again
    assert scores(outcomes) == scores(run(problem, GRID, quick))
    assert list(run(problem, GRID, quick, journal=journal)) == outcomes


def test_a_journal_serves_another_grid_of_the_same_problem(make, quick, tmp_path):
    problem = make()
    journal = Journal(tmp_path / "cells.jsonl", fingerprint(problem, quick))
    small = list(run(problem, Grid(("ridge",), (4,), (10,), 1), quick, journal=journal))
    assert next(run(problem, GRID, quick, journal=journal)) == small[0]


def test_a_journal_of_other_work_is_begun_anew(make, quick, tmp_path, caplog):
    grid = Grid(("ridge",), (4,), (10,), 1)
    path = tmp_path / "cells.jsonl"
    for problem in (make(seed=0), make(seed=1)):
        list(run(problem, grid, quick, journal=Journal(path, fingerprint(problem, quick))))
    assert "of other work" in caplog.text
    assert len(path.read_text().splitlines()) == 2


def test_a_damaged_journal_is_begun_anew(make, quick, tmp_path):
    problem = make()
    journal = Journal(tmp_path / "cells.jsonl", fingerprint(problem, quick))
    journal.begin()
    journal.add({"cell": 1, "scores": None})
    assert len(list(run(problem, Grid(("ridge",), (4,), (10,), 1), quick, journal=journal))) == 1


def test_damaged_entries_of_a_journal_cost_their_cells_alone(make, quick, tmp_path, caplog):
    problem = make()
    journal = Journal(tmp_path / "cells.jsonl", fingerprint(problem, quick))
    first = list(run(problem, GRID, quick, journal=journal))
    header, fields, nobody, *rest = journal.path.read_bytes().splitlines(keepends=True)
    fields = fields.replace(b'"cell": {', b'"call": {')
    nobody = nobody.replace(b'"method": "', b'"method": "\xff')
    journal.path.write_bytes(b"".join((header, fields, nobody, *rest)))
    outcomes = list(run(problem, GRID, quick, journal=journal))
    assert outcomes[: len(rest)] == first[2:]  # times included: nothing was computed again
    assert scores(outcomes) == scores(first)
    assert caplog.text.count("passed over a damaged cell") == 1


def test_a_journal_that_cannot_be_written_is_kept(make, quick, tmp_path):
    problem = make()
    journal = Journal(tmp_path / "cells.jsonl", fingerprint(problem, quick))
    grid = Grid(("ridge",), (4,), (10,), 1)
    list(run(problem, grid, quick, journal=journal))
    before = journal.path.read_bytes()
    room = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, room[1]))
    try:
        with pytest.raises(InputError, match=r"cells\.jsonl"):
            list(run(problem, grid, quick, journal=journal))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, room)
    assert journal.path.read_bytes() == before


def test_the_fingerprint_is_of_data_protocol_and_settings(make, make_take, quick):
    one = make()
    others = [
        make(make_take(frames=120, posed=119, animation=0)),
        make(noise=0.1),
        make_problem(one.take, Protocol(), across=make_take(120, 120, 0)),
    ]
    prints = [fingerprint(problem, quick) for problem in (one, *others)]
    assert len({*prints, fingerprint(one)}) == 5
    assert fingerprint(make(), quick) == prints[0]


def test_an_outcome_survives_json(make, quick):
    outcome = evaluate(make(), Cell("ridge", 5, 5, 0), quick)
    assert Outcome.from_dict(json.loads(json.dumps(outcome.as_dict()))) == outcome
    failed = Outcome(Cell("ridge", 2, 5, 0), failure="too few")
    assert Outcome.from_dict(failed.as_dict()) == failed
