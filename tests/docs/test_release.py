"""The version stands in one place of the code; what is said of it elsewhere agrees."""

from __future__ import annotations

import re

from following import ROOT

import facert

CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
RELEASES = re.findall(r"^## (\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)$", CHANGES, re.MULTILINE)


def test_the_newest_changes_are_those_of_this_version() -> None:
    assert RELEASES[0][0] == facert.__version__


def test_versions_and_their_days_fall_from_the_top() -> None:
    assert len(RELEASES) == CHANGES.count("\n## ")
    numbers = [tuple(map(int, version.split("."))) for version, _ in RELEASES]
    assert numbers == sorted(set(numbers), reverse=True)
    days = [day for _, day in RELEASES]
    assert days == sorted(days, reverse=True)


def test_the_citation_is_of_this_version_and_licence() -> None:
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    facts = dict(line.split(": ", 1) for line in lines if re.match(r"[\w-]+: ", line))
    assert (facts["version"], facts["date-released"]) == RELEASES[0]
    assert (ROOT / "LICENSE").read_text(encoding="utf-8").startswith(f"{facts['license']} License")
