"""The lists of changes that `python -m experiments.mutants` makes are in step with the code."""

from __future__ import annotations

import pytest

from experiments.mutants.__main__ import Copy, judged, matches
from experiments.mutants.listed import ROOT, Change, changes

CHANGES = changes()
ROOMS = {"models", "methods", "topology", "preprocess", "retarget", "data", "settings.py"}


def test_each_change_fits_its_file():
    for change in CHANGES:
        change.applied((ROOT / "facert" / change.file).read_text(encoding="utf-8"))


def test_each_change_has_tests_that_exist_and_a_name_of_its_own():
    for change in CHANGES:
        assert change.tests, change.what
        for test in change.tests:
            path, _, name = test.partition("::")
            assert name in (ROOT / "tests" / path).read_text(encoding="utf-8"), change.what
    assert {change.room for change in CHANGES} == ROOMS
    assert len({change.what for change in CHANGES}) == len(CHANGES)


def test_a_change_that_does_not_fit_is_named():
    change = CHANGES[0]
    with pytest.raises(ValueError, match=f"{change.file}: 0 times"):
        change.applied("another text")
    with pytest.raises(ValueError, match="2 times"):
        change.applied(2 * change.old)


class StubbedCopy(Copy):
    """A copy of one file, whose tests end as one is told."""

    def __init__(self, folder, outcome):
        self.folder, self.outcome = folder, outcome
        (folder / "facert").mkdir()
        (folder / "facert" / "a.py").write_text("x = 1\n", encoding="utf-8")

    def run(self, *_, **__):
        assert (self.folder / "facert" / "a.py").read_text(encoding="utf-8") == "x = 2\n"
        return self.outcome


@pytest.mark.parametrize(
    ("outcome", "reason", "expected"),
    [
        ("killed by tests/a.py::b", None, "killed"),
        ("killed by tests/a.py::b", "none can", "has a reason"),
        ("survived", None, "survived"),
        ("survived", "none can", "equivalent"),
        ("interrupted\n...", "none can", "broken"),
    ],
)
def test_a_change_is_made_judged_and_taken_back(outcome, reason, expected, tmp_path, capsys):
    copy = StubbedCopy(tmp_path, outcome)
    change = Change("two for one", "a.py", "x = 1", "x = 2", ["a.py"], reason)
    assert judged(copy, change) == expected
    assert "two for one" in capsys.readouterr().out
    assert (tmp_path / "facert" / "a.py").read_text(encoding="utf-8") == "x = 1\n"


@pytest.mark.parametrize(("old", "new"), [("x = 3", "x = 2"), ("x = 1", "x = 1"), ("1", "(")])
def test_a_change_that_cannot_be_made_is_broken(old, new, tmp_path):
    change = Change("another", "a.py", old, new, ["a.py"])
    assert judged(StubbedCopy(tmp_path, "survived"), change) == "broken"


def test_words_choose_changes():
    change = Change("two for one", "a.py", "1", "2", ["models/test_a.py"])
    assert matches(change, [])
    assert matches(change, ["two", "models"])
    assert not matches(change, ["two", "methods"])
