"""Parts of a report. All text is plain: `facert.pages.report.page` escapes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from facert.data.verdict import Level
from facert.evaluation.metrics import Comparison


@dataclass(frozen=True)
class Table:
    """Cells as text under their columns, the first one left-aligned; the `best` rows stand out.

    Where all are `words`, all are left-aligned.
    """

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    best: frozenset[int] = frozenset()
    words: bool = False


@dataclass(frozen=True)
class Picture:
    """An image that is part of the page, ``data:image/...``."""

    caption: str
    uri: str


@dataclass(frozen=True)
class Judged:
    """The verdict on a take: level, reasons, what to do next, worst frames, and a clip of them.

    The `kinds` are those of the reasons that make it no good one.
    """

    level: Level
    kinds: tuple[str, ...]
    reasons: tuple[str, ...]
    cures: tuple[str, ...]
    pictures: tuple[Picture, ...] = ()
    clip: Picture | None = None  # ``data:video/...``


@dataclass(frozen=True)
class Section:
    """One result: its verdict, text, pictures, tables and facts by their names.

    The page shows the `comparison` of a performance with its truth beside those of the others.
    """

    title: str
    text: str = ""
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    comparison: Comparison | None = None
    judged: Judged | None = None


@dataclass(frozen=True)
class ReportPage:
    """A page, and the versions of the libraries that made it."""

    title: str
    sections: tuple[Section, ...]
    versions: Mapping[str, str]
