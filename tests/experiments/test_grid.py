from dataclasses import replace

from experiments.drawing import Panel, draw_panels
from experiments.grid import KEPT, Case, CellJournal, code_of, kinds
from experiments.report import markdown, write_csv
from facert.evaluation.cells import Cell, Outcome
from facert.evaluation.metrics import Scores
from facert.evaluation.protocol import Protocol
from facert.evaluation.table import summarise
from facert.methods.registry import REGISTRY

CASE = Case("rom", "arkit")


def outcome(method, labels=10, rms=0.1):
    return Outcome(Cell(method, labels, 100, 0), Scores(rms, (rms,), rms))


def test_methods_of_one_file_share_their_code_and_others_do_not():
    codes = {method: code_of(method) for method in REGISTRY}
    assert codes["ridge"] == codes["pls"]
    assert len({codes["ridge"], codes["svr"], codes["ssgplvm"], codes["auto"]}) == 4


def test_kept_cells_serve_as_long_as_their_code_is_the_same(tmp_path):
    path = tmp_path / "cells.jsonl"
    journal = CellJournal(path, "problem")
    journal.begin()
    for method in ("ridge", "svr"):
        journal.add(outcome(method).as_dict())
    path.write_text(path.read_text().replace(code_of("svr"), "older"))
    assert [Outcome.from_dict(entry).cell.method for entry in journal.begin()] == ["ridge"]
    assert "older" in path.read_text()  # of use again when the change is taken back


def test_every_case_has_its_own_journal():
    cases = [
        CASE,
        replace(CASE, target="units"),
        replace(CASE, split="block"),
        replace(CASE, noise=0.05),
        replace(CASE, test_frames=50),
    ]
    assert len({case.path for case in cases}) == len(cases)
    assert {case.path.parent for case in cases} == {KEPT}


def test_problems_come_target_by_target():
    assert kinds(["rom", "optical_cheeks", "utterance_a"]) == [
        ("rom", "arkit"),
        ("utterance_a", "arkit"),
        ("rom", "units"),
        ("utterance_a", "units"),
        ("optical_cheeks", "solved"),
    ]


def test_tables_and_records_are_plain_text(tmp_path):
    assert markdown(["a", "b"], [["x", "1"]]) == "| a | b |\n| --- | ---: |\n| x | 1 |\n"
    write_csv(tmp_path / "rows.csv", [{"name": "x", "value": 1 / 3, "none": None}])
    assert (tmp_path / "rows.csv").read_text() == "name,value,none\nx,0.333333,\n"


def test_panels_show_a_curve_a_method_and_a_line_a_reference():
    outcomes = [outcome("auto"), outcome("auto", 20), outcome("ssgpr"), outcome("ssgpr", 20)]
    rows = summarise(outcomes, Protocol())
    references = summarise([outcome("ridge")], Protocol())
    figure = draw_panels([Panel("one", rows, references), Panel("two", rows)], "labels", "all")
    first, second = figure.axes
    assert [len(axes.containers) for axes in (first, second)] == [2, 2]
    assert len(first.lines) - len(second.lines) == 1
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert sorted(names) == ["auto", "ridge", "ssgpr"]
    assert names[0] == "auto"
