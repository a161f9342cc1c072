"""A report as HTML that needs nothing but itself: no network, no script, no other file."""

from __future__ import annotations

from functools import cache
from importlib.metadata import version
from importlib.resources import files

from jinja2 import Environment, StrictUndefined, Template

from facert.data.text import printable_lines
from facert.data.verdict import LEVELS
from facert.data.version import CREATED_BY
from facert.pages.report.comparison_section import comparison_section
from facert.pages.report.judged import summary_section, worst_first
from facert.pages.report.sections import ReportPage, Section

LIBRARIES = ("facert", "torch", "numpy", "scipy", "scikit-learn", "matplotlib")


def make_report(title: str, sections: tuple[Section, ...]) -> ReportPage:
    """A report with what made it; several takes are judged first, the worst before others."""
    first = [summary_section(sections), comparison_section(sections)]
    sections = (*(section for section in first if section is not None), *worst_first(sections))
    return ReportPage(title, sections, {name: version(name) for name in LIBRARIES})


def to_html(report: ReportPage) -> str:
    """The page; the same report gives the same text. All that came from files is escaped."""
    return _template().render(report=report, levels=LEVELS, created_by=CREATED_BY)


@cache
def _template() -> Template:
    text = files("facert.pages.report").joinpath("report.html.j2").read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_printable,
    )
    return environment.from_string(text)


def _printable(value: object) -> object:
    """A text as a page can hold it: no control characters, no reversed writing."""
    return printable_lines(value) if isinstance(value, str) else value
