"""The table that ``facert eval`` prints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby

from rich import box
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from facert.cli.shared import console
from facert.data.text import plural
from facert.evaluation.summary import Row, best

Column = Callable[[Row], str]
WIDEST = 160
CANNOT = "cannot run"


def error_table(rows: Sequence[Row], title: str) -> Table:
    """A section for each number of labels and of unlabelled data, its best method in bold.

    Columns that say nothing in these rows are left out. Why a method could not run stands below.
    """
    columns = _columns(rows)
    table = Table(
        title=Text(title),
        title_justify="left",
        caption=Text("\n".join(_failures(rows))),
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for name in columns:
        table.add_column(name, justify="left" if name == "method" else "right", no_wrap=True)
    for _, members in groupby(rows, key=lambda row: (row.labels, row.unlabelled)):
        section = list(members)
        least = best(section)
        for row in section:
            cells = [show(row) for show in columns.values()]
            table.add_row(*cells, style="bold" if row is least else None)
        table.add_section()
    # Numbers cut short say nothing: the table is as wide as it must be, in a file as well.
    options = console.out.options.update(width=WIDEST)
    table.width = Measurement.get(console.out, options, table).maximum
    return table


def _columns(rows: Sequence[Row]) -> dict[str, Column]:
    columns: dict[str, Column] = {"labels": lambda row: str(row.labels)}
    if len({row.unlabelled for row in rows}) > 1:
        columns["unlabelled"] = lambda row: str(row.unlabelled)
    columns |= {
        "method": lambda row: row.method,
        "RMS": lambda row: CANNOT if row.rms is None else _figures(row.rms, 4),
        "±": lambda row: _figures(row.rms_se, 4),
        "/ best": lambda row: _figures(row.ratio_to_best, 2),
        "of range": lambda row: "-" if row.rms_normalised is None else f"{row.rms_normalised:.1%}",
        "jitter": lambda row: _figures(row.jitter, 4),
    }
    if any(row.vertex_rms is not None for row in rows):
        columns["vertex"] = lambda row: _figures(row.vertex_rms, 4)
        columns["95 %"] = lambda row: _figures(row.vertex_p95, 4)
    columns |= {
        "fit s": lambda row: _figures(row.fit_seconds, 2),
        "ms/frame": lambda row: _figures(row.frame_ms, 3),
    }
    if any(row.failure and row.repeats for row in rows):
        columns["draws"] = lambda row: str(row.repeats)
    return columns


def _failures(rows: Sequence[Row]) -> list[str]:
    """One line for each reason: who failed, at how many labels, and why."""
    reasons: dict[tuple[int, str], list[str]] = {}
    for row in rows:
        if row.failure:
            reasons.setdefault((row.labels, row.failure), []).append(row.method)
    return [
        f"{', '.join(dict.fromkeys(methods))} with {plural(labels, 'label')}: {reason}"
        for (labels, reason), methods in reasons.items()
    ]


def _figures(value: float | None, decimals: int) -> str:
    return "-" if value is None else f"{value:.{decimals}f}"
