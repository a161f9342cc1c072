"""The lists of changes that `python -m experiments.mutants` makes are in step with the code."""

from __future__ import annotations

import pytest

from experiments.mutants.listed import ROOT, changes

CHANGES = changes()
ROOMS = {"models", "methods", "topology", "preprocess", "data"}


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
