"""Parts of a report. All text is plain: `facert.pages.report.page` escapes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from facert.evaluation.metrics import Comparison


@dataclass(frozen=True)
class Table:
    """Cells as text under their columns, the first one left-aligned; the `best` rows stand out."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    best: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Picture:
    """An image that is part of the page, ``data:image/...``."""

    caption: str
    uri: str


@dataclass(frozen=True)
class Section:
    """One result: text, pictures, tables and facts by their names.

    The page shows the `comparison` of a performance with its truth beside those of the others.
    """

    title: str
    text: str = ""
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    comparison: Comparison | None = None


@dataclass(frozen=True)
class ReportPage:
    """A page, and the versions of the libraries that made it."""

    title: str
    sections: tuple[Section, ...]
    versions: Mapping[str, str]
