"""The lists of changes that `python -m experiments.mutants` makes are in step with the code."""

from __future__ import annotations

import ast

import pytest

from experiments.mutants.listed import ROOT, changes

CHANGES = changes()
ROOMS = ("models", "methods", "topology", "preprocess")


def test_each_change_fits_its_file_and_leaves_python():
    for change in CHANGES:
        text = (ROOT / "facert" / change.file).read_text(encoding="utf-8")
        changed = ast.parse(change.applied(text))
        assert ast.dump(changed) != ast.dump(ast.parse(text)), change.what


def test_each_change_has_tests_that_exist_and_a_name_of_its_own():
    for change in CHANGES:
        assert change.tests, change.what
        assert all((ROOT / "tests" / test).is_file() for test in change.tests), change.what
        assert change.room in ROOMS
    assert len({change.what for change in CHANGES}) == len(CHANGES)


def test_a_change_that_does_not_fit_is_named():
    change = CHANGES[0]
    with pytest.raises(ValueError, match=f"{change.file}: 0 times"):
        change.applied("another text")
    with pytest.raises(ValueError, match="2 times"):
        change.applied(2 * change.old)
