"""What a report is made of. All text is plain: `facert.pages.report.page` escapes it."""

from __future__ import annotations

from dataclasses import dataclass

from facert.evaluation.metrics import Comparison


@dataclass(frozen=True)
class Fact:
    """A name and its value."""

    name: str
    value: str


@dataclass(frozen=True)
class Table:
    """Cells as text; the first column is left-aligned.

    Parameters
    ----------
    caption : str
    columns : tuple of str
    rows : tuple of tuple of str
    best : frozenset of int
        Rows that stand out.
    """

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    best: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Picture:
    """An image that is part of the page.

    Parameters
    ----------
    caption : str
    uri : str
        ``data:image/...``.
    """

    caption: str
    uri: str


@dataclass(frozen=True)
class Section:
    """One result.

    Parameters
    ----------
    title, text : str
    pictures : tuple of Picture
    tables : tuple of Table
    facts : tuple of Fact
    comparison : Comparison, optional
        Of a performance with its truth; the page shows it beside those of the others.
    """

    title: str
    text: str = ""
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    facts: tuple[Fact, ...] = ()
    comparison: Comparison | None = None


@dataclass(frozen=True)
class Report:
    """A page.

    Parameters
    ----------
    title : str
    sections : tuple of Section
    versions : tuple of Fact
        Of the libraries that made the page.
    """

    title: str
    sections: tuple[Section, ...]
    versions: tuple[Fact, ...]
