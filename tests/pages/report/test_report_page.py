"""Reports: everything in one file, and nothing in it but text and pictures."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import asdict, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from facert.data.rig import Rig
from facert.data.take import Controls, Take
from facert.errors import InputError
from facert.evaluation.table import EvaluationRow
from facert.pages.report.evaluation_section import read_evaluation
from facert.pages.report.page import make_report, to_html
from facert.pages.report.performance_section import fits, performance_section, truth_among
from facert.pages.report.sections import Section, Table

HOSTILE = '<script>alert("1")</script>'
CONTROLS = ("$x", "</text><script>", "--><script>", "<img src=http://a.b/c>")


class Seen(HTMLParser):
    """The tags of a page, what they refer to, and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.links: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.add(tag)
        self.links += [value for name, value in attrs if name in ("src", "href")]

    def handle_data(self, data: str) -> None:
        self.text += data


def row(method: str, labels: int, rms: float | None, **others) -> EvaluationRow:
    values = {"noise": 0.0, "missing": 0.0, "repeats": 2, "rms_se": 0.01, "ratio_to_best": 1.0}
    values |= {"rms_normalised": 0.1, "jitter": 0.01, "vertex_rms": None, "vertex_p95": None}
    values |= {"per_control": (0.1, 0.2, 0.3, 0.4), "fit_seconds": 0.1, "frame_ms": 0.1}
    return EvaluationRow(method=method, labels=labels, unlabelled=5, rms=rms, **(values | others))


@pytest.fixture
def evaluation(tmp_path: Path) -> Path:
    """What `facert eval --json` writes, with names that an enemy chose."""
    rows = [row("gpr", n, 1.0 / n) for n in (5, 10)] + [row(HOSTILE, n, 0.5) for n in (5, 10)]
    rows.append(row("svr", 5, None, failure=f"too few {HOSTILE}"))
    rows.sort(key=lambda one: one.labels)
    settings = {"take": HOSTILE, "controls": CONTROLS, "noise": 0.5, "versions": {"torch": HOSTILE}}
    path = tmp_path / "result.json"
    path.write_text(json.dumps({"settings": settings, "rows": [asdict(one) for one in rows]}))
    return path


@pytest.fixture
def performance(make_take) -> tuple[Take, Take, Rig]:
    truth = replace(make_take(posed=60), controls=Controls(CONTROLS), created_by=HOSTILE)
    result = replace(truth, params=truth.params + 0.1, std=np.full_like(truth.params, 0.05))
    rng = np.random.default_rng(0)
    neutral = rng.normal(size=(6, 3))
    rig = Rig(neutral, rng.normal(size=(4, 6, 3)), CONTROLS, np.array([[0, 1, 2], [3, 4, 5]]))
    return result, truth, rig


def test_the_page_is_one_file_without_script_or_network(evaluation, performance) -> None:
    result, truth, rig = performance
    sections = (read_evaluation(evaluation), performance_section(HOSTILE, result, rig, truth))
    text = to_html(make_report(HOSTILE, sections))
    seen = Seen(text)
    assert not seen.tags & {"script", "link", "iframe", "object", "embed", "base", "svg"}
    assert all(link.startswith(("data:image/", "#")) for link in seen.links)
    assert "default-src 'none'" in text
    assert HOSTILE in seen.text
    assert HOSTILE not in text


def test_figures_name_what_is_drawn_as_it_is_spelled_and_hold_no_script(
    evaluation, performance
) -> None:
    result, truth, rig = performance
    sections = (read_evaluation(evaluation), performance_section("a", result, rig, truth))
    drawings = [
        base64.b64decode(picture.uri.split(",")[1]).decode()
        for section in sections
        for picture in section.pictures
        if picture.uri.startswith("data:image/svg+xml")
    ]
    assert len(drawings) == 3
    for drawing in drawings:
        outside_comments = re.sub(r"<!--.*?-->", "", drawing, flags=re.DOTALL)
        assert "<script" not in outside_comments
        assert "<img" not in outside_comments


def test_the_same_results_give_the_same_page(evaluation) -> None:
    one, other = (to_html(make_report("a", (read_evaluation(evaluation),))) for _ in range(2))
    assert one == other


def test_tables_mark_the_best_and_name_who_could_not_run(evaluation) -> None:
    section = read_evaluation(evaluation)
    assert [table.caption.split(" ")[0] for table in section.tables] == ["5", "10"]
    for table in section.tables:
        (best,) = table.best
        assert table.rows[best][0] == "gpr"
        assert "vertex" not in table.columns  # nothing to show
        assert all(len(cells) == len(table.columns) for cells in table.rows)
    assert "svr: too few" in section.text


def test_an_evaluation_of_failures_alone_has_tables_and_no_figures(tmp_path) -> None:
    path = tmp_path / "result.json"
    rows = [asdict(row("svr", 5, None, failure="too few"))]
    path.write_text(json.dumps({"settings": {}, "rows": rows}))
    section = read_evaluation(path)
    assert section.pictures == ()
    assert len(section.tables) == 1


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda content: content["rows"], "settings and rows"),
        (lambda content: content | {"rows": []}, "rows"),
        (lambda content: content | {"rows": [7]}, "rows/0: expected a table"),
        (lambda content: content | {"rows": [content["rows"][0] | {"rms": "1"}]}, "rows/0/rms"),
        (lambda content: content | {"rows": [content["rows"][0] | {"labels": True}]}, "labels"),
        (lambda content: content | {"rows": [content["rows"][0] | {"rms": 1e999}]}, "rows/0/rms"),
        (
            lambda content: content | {"rows": [content["rows"][0] | {"per_control": ["a"]}]},
            "per_control",
        ),
    ],
)
def test_a_file_that_is_something_else_is_refused_in_a_line(evaluation, damage, message) -> None:
    evaluation.write_text(json.dumps(damage(json.loads(evaluation.read_text()))))
    with pytest.raises(InputError, match=message) as caught:
        read_evaluation(evaluation)
    assert str(evaluation) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "NaN"])
def test_a_file_that_is_no_json_is_refused(tmp_path, text) -> None:
    path = tmp_path / "result.json"
    path.write_text(text)
    with pytest.raises(InputError):
        read_evaluation(path)


def test_errors_are_given_by_region_and_in_all(performance) -> None:
    result, truth, rig = performance
    section = performance_section("a", result, rig, truth)
    (table,) = section.tables
    assert table.rows[-1] == ("all", "4", "0.1000")
    assert [picture.uri[:14] for picture in section.pictures] == [
        "data:image/png",
        "data:image/svg",
    ]
    assert len(performance_section("a", result).pictures) == 1


def test_truth_and_rig_are_known_by_what_they_hold(performance, make_take) -> None:
    result, truth, rig = performance
    near = replace(truth, controls=Controls(("a", *CONTROLS[1:])))
    assert truth_among([near, truth], result) is truth
    assert truth_among([result, make_take(posed=60)], result) is None
    assert fits(rig, result)
    assert not fits(rig, make_take())
    with pytest.raises(InputError, match="--truth"):
        performance_section("a", result, truth=make_take(frames=30, posed=30))


def test_what_is_empty_leaves_no_trace() -> None:
    text = to_html(make_report("a", (Section("b", tables=(Table("c", ("d",), (("e",),)),)),)))
    assert "<figure" not in text
    assert "<dl>" not in text
    assert "<nav>" not in text
    assert "<dl>" in to_html(make_report("a", (Section("b", facts={"c": "d"}),)))


def test_several_results_are_compared_first_by_part_of_the_face(make_take) -> None:
    names = ("jawOpen", "browInnerUp", "cheekPuff", "mouthSmileLeft")
    truth = replace(make_take(posed=60), controls=Controls(names))
    results = [replace(truth, params=truth.params + off) for off in (0.2, 0.1)]
    sections = tuple(
        performance_section(name, result, truth=truth)
        for name, result in zip("ab", results, strict=True)
    )
    first, *others = make_report("c", sections).sections
    assert tuple(others) == sections
    (table,) = first.tables
    assert table.columns == (
        "result", "frames", "controls", "brows", "cheeks", "mouth", "jaw", "all"
    )  # fmt: skip
    assert table.rows[1] == ("b", "60", "4", *5 * ("0.1000",))
    assert table.best == {1}
    assert make_report("c", sections[:1]).sections == sections[:1]


def test_a_truth_with_other_controls_is_compared_in_those_that_are_shared(performance) -> None:
    result, truth, rig = performance
    known = replace(truth, controls=Controls(("a", *CONTROLS[1:])))
    section = performance_section("a", result, rig, known)
    assert section.tables[0].rows[-1] == ("all", "3", "0.1000")
    assert section.text.endswith("not compared: a (only in the truth); $x (only in the result)")
    assert truth_among([known], result) is known
    other = replace(truth, controls=Controls(("a", "b", "c", CONTROLS[3])))
    assert truth_among([other], result) is None
    with pytest.raises(InputError, match="poses of some of the take's controls, found none"):
        performance_section("a", result, truth=replace(truth, controls=Controls(tuple("abcd"))))
