"""The table of results: means over the repeats, and the columns that show them everywhere."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from facert.data.text import plural
from facert.evaluation.cells import Outcome
from facert.evaluation.paired import MeanWithError
from facert.evaluation.protocol import Protocol

MEASURES = ("rms_normalised", "jitter", "vertex_rms", "vertex_p95")
"""The scores, besides the RMS, whose means are in a row."""


@dataclass(frozen=True)
class EvaluationRow:
    """A method at one number of labels and of unlabelled data: means over the repeats."""

    method: str
    labels: int
    unlabelled: int
    # Noise and gaps of the protocol
    noise: float
    missing: float
    repeats: int  # How many of them the method could run
    # Mean over the repeats and its standard error; None where there is none (no repeat, or one)
    rms: float | None
    rms_se: float | None
    # `rms` over the least one of the methods that ran every repeat, on the same draws
    ratio_to_best: float | None
    # Means of the measures of `facert.evaluation.metrics.Scores`
    rms_normalised: float | None
    jitter: float | None
    vertex_rms: float | None
    vertex_p95: float | None
    per_control: tuple[float, ...]
    # Training, and mapping one frame of many
    fit_seconds: float | None
    frame_ms: float | None
    failure: str = ""  # Why the method could not run some repeat; empty when it ran all

    @property
    def draws(self) -> int | None:
        """Number of repeats that ran, if some failed; None if all did or none ran."""
        return self.repeats if self.failure and self.repeats else None


@dataclass(frozen=True)
class Column:
    """A column of the table, on a terminal and in a report.

    It shows a field of an `EvaluationRow`, formatted as `form`, or `absent` where there is none.
    """

    title: str
    field: str
    form: str = ""
    absent: str = "-"

    def text(self, row: EvaluationRow) -> str:
        """The cell of a row."""
        value = getattr(row, self.field)
        return self.absent if value is None else f"{value:{self.form}}"


COLUMNS = (
    Column("method", "method"),
    Column("RMS", "rms", ".4f", "cannot run"),
    Column("±", "rms_se", ".4f"),
    Column("/ best", "ratio_to_best", ".2f"),
    Column("of range", "rms_normalised", ".1%"),
    Column("jitter", "jitter", ".4f"),
    Column("vertex", "vertex_rms", ".4f"),
    Column("95 %", "vertex_p95", ".4f"),
    Column("fit s", "fit_seconds", ".2f"),
    Column("ms/frame", "frame_ms", ".3f"),
    Column("draws", "draws"),
)


def columns_of(rows: Sequence[EvaluationRow]) -> list[Column]:
    """The columns that show something in these rows."""
    return [
        column
        for column in COLUMNS
        if column.field == "rms" or any(getattr(row, column.field) is not None for row in rows)
    ]


def sections_of(
    rows: Sequence[EvaluationRow],
) -> Iterator[tuple[list[EvaluationRow], EvaluationRow | None]]:
    """The rows of each number of labels and of unlabelled data, and the best one."""
    for _, members in groupby(rows, lambda row: (row.labels, row.unlabelled)):
        section = list(members)
        yield section, best(section)


def summarise(outcomes: Iterable[Outcome], protocol: Protocol) -> list[EvaluationRow]:
    """Rows by rising labels, then unlabelled; within them the best method first, failures last."""
    groups: dict[tuple[int, int, str], list[Outcome]] = defaultdict(list)
    for outcome in sorted(outcomes, key=lambda outcome: outcome.cell.repeat):
        cell = outcome.cell
        groups[cell.labels, cell.unlabelled, cell.method].append(outcome)
    rows = [_row(members, protocol) for members in groups.values()]
    rows = [_with_ratio(row, rows) for row in rows]
    return sorted(rows, key=_rank)


def failures_of(rows: Sequence[EvaluationRow]) -> list[str]:
    """Lines on failures, one for each reason: the methods, the numbers of labels, the reason."""
    reasons: dict[tuple[int, str], list[str]] = defaultdict(list)
    for row in rows:
        if row.failure:
            reasons[row.labels, row.failure].append(row.method)
    return [
        f"{', '.join(dict.fromkeys(methods))} with {plural(labels, 'label')}: {reason}"
        for (labels, reason), methods in reasons.items()
    ]


def best(rows: Sequence[EvaluationRow]) -> EvaluationRow | None:
    """The row of least RMS among those without a failure."""
    complete = [row for row in rows if row.rms is not None and not row.failure]
    return min(complete, key=lambda row: row.rms or 0.0, default=None)


def _row(outcomes: Sequence[Outcome], protocol: Protocol) -> EvaluationRow:
    cell = outcomes[0].cell
    ran = [outcome for outcome in outcomes if outcome.scores is not None]
    scores = [outcome.scores for outcome in ran if outcome.scores is not None]
    error = MeanWithError.of(np.array([s.rms for s in scores])) if scores else None
    return EvaluationRow(
        method=cell.method,
        labels=cell.labels,
        unlabelled=cell.unlabelled,
        noise=protocol.noise,
        missing=protocol.missing,
        repeats=len(ran),
        rms=error.value if error else None,
        rms_se=error.se if error and len(scores) > 1 else None,
        ratio_to_best=None,
        per_control=tuple(np.mean([s.per_control for s in scores], axis=0)) if scores else (),
        **{name: _mean(getattr(s, name) for s in scores) for name in MEASURES},
        fit_seconds=_mean(outcome.fit_seconds for outcome in ran),
        frame_ms=_mean(outcome.frame_ms for outcome in ran),
        failure=next((outcome.failure for outcome in outcomes if outcome.failure), ""),
    )


def _with_ratio(row: EvaluationRow, rows: Sequence[EvaluationRow]) -> EvaluationRow:
    least = best([r for r in rows if (r.labels, r.unlabelled) == (row.labels, row.unlabelled)])
    if row.rms is None or least is None or not least.rms:
        return row
    return replace(row, ratio_to_best=row.rms / least.rms)


def _rank(row: EvaluationRow) -> tuple[int, int, bool, float, str]:
    error = np.inf if row.rms is None else row.rms
    return row.labels, row.unlabelled, bool(row.failure), error, row.method


def _mean(values: Iterable[float | None]) -> float | None:
    """Mean over the repeats in which there was something to measure."""
    measured = [value for value in values if value is not None]
    return float(np.mean(measured)) if measured else None
