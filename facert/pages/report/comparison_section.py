"""Several results beside each other: what each misses of the truth, by part of the face."""

from __future__ import annotations

from collections.abc import Sequence

from facert.evaluation.metrics import Comparison
from facert.pages.report.sections import Section, Table

ALL = "all"


def comparison_section(sections: Sequence[Section]) -> Section | None:
    """A table of the sections that have a truth; None where they are fewer than two."""
    compared = [(_name(each), each.comparison) for each in sections if each.comparison]
    if len(compared) < 2:
        return None
    found = [comparison for _, comparison in compared]
    parts = (*_parts(found), ALL)
    rows = tuple((name, *_cells(comparison, parts)) for name, comparison in compared)
    least = min(comparison.rms for comparison in found)
    best = frozenset(i for i, comparison in enumerate(found) if comparison.rms == least)
    columns = ("result", "frames", "controls", *parts)
    table = Table("RMS to the truth by part of the face", columns, rows, best)
    return Section("Comparison", _warning(found), tables=(table,))


def _name(section: Section) -> str:
    """Name of the file, without the kind of result before it."""
    return section.title.partition(": ")[2] or section.title


def _parts(found: Sequence[Comparison]) -> tuple[str, ...]:
    """Parts of the face that any result has, in the order of the most complete one."""
    fullest = sorted(found, key=lambda one: -len(one.groups))
    return tuple(dict.fromkeys(group.name for one in fullest for group in one.groups))


def _cells(comparison: Comparison, parts: tuple[str, ...]) -> tuple[str, ...]:
    errors = {group.name: f"{group.rms:.4f}" for group in comparison.groups}
    errors[ALL] = f"{comparison.rms:.4f}"
    counts = str(comparison.frames), str(comparison.controls)
    return *counts, *(errors.get(part, "") for part in parts)


def _warning(found: Sequence[Comparison]) -> str:
    alike = len({(one.frames, one.controls) for one in found}) == 1
    return "" if alike else "Not all are of the same frames and controls."
