from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.data.verdict import Reason, Verdict
from facert.io.take import write_take
from facert.io.verdict import beside_result
from facert.pages.report.folder import folder_sections
from facert.pages.report.page import make_report, to_html

LEVELS = {"a.h5": "good", "b.h5": "bad", "c.h5": "look at it"}


@pytest.fixture(scope="module")
def folder(make_take, tmp_path_factory):
    """Results of three levels, and one that is damaged."""
    path = tmp_path_factory.mktemp("results")
    take = make_take(frames=12)
    take = replace(take, std=np.full_like(take.params, 0.1))
    everywhere = np.arange(12)
    for name, level in LEVELS.items():
        reasons = (
            Reason("jumps", level, "3 jumps", "look at TAKE", everywhere),
            Reason("idle controls", "good", "a rests", "pose a", everywhere[:0]),
        )
        verdict = Verdict(reasons, np.zeros(12), take.time)
        write_take(take, path / name, beside=beside_result(verdict))
    (path / "damaged.csv").write_text("time,jawOpen\n0,<b>\n")
    return path


def test_the_worst_section_comes_first_and_what_cannot_be_read_is_named(folder):
    report = make_report("day", folder_sections(folder))
    titles = [section.title for section in report.sections]
    assert titles == [
        "Verdicts",
        "Left out",
        "Performance: b.h5",
        "Performance: c.h5",
        "Performance: a.h5",
    ]
    ((name, why),) = report.sections[1].tables[0].rows
    assert name == "damaged.csv"
    assert "jawOpen" in why
    page = to_html(report)
    assert '<td class="level look-at-it">look at it</td>' in page
    assert "<b>" not in page


def test_each_reason_has_its_advice_notes_as_well(folder):
    sections = {section.title[13:]: section.judged for section in folder_sections(folder)}
    assert sections["b.h5"].cures == ("jumps: look at b.h5", "idle controls: pose a")
    first, *notes = sections["a.h5"].cures
    assert first.startswith("Nothing needs to be done")
    assert notes == ["jumps: look at a.h5", "idle controls: pose a"]


def test_the_actor_is_drawn_where_his_weights_are_arkits(folder, make_take, monkeypatch):
    from facert.pages.report import performance_section as section

    names = ("jawOpen", "mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft", "eyeBlinkRight")
    take = make_take(frames=12)
    weights = facert.Source(np.full((12, 5), 0.1), names)
    drawn = []
    monkeypatch.setattr(section, "judged", lambda *given: drawn.append(given[3]))
    verdict = Verdict((), np.ones(12), take.time)
    for source in (take.source, weights):
        section.performance_section("a", replace(take, source=source), verdict=verdict)
    assert [[face.label for face in faces] for faces in drawn] == [[], ["actor"]]
