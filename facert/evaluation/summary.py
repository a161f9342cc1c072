"""Means over the repeats: one row for each method, number of labels and of unlabelled data."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray
from facert.evaluation.cells import Outcome
from facert.evaluation.metrics import Scores
from facert.evaluation.protocol import Protocol


@dataclass(frozen=True)
class Row:
    """A method at one number of labels and of unlabelled data: means over the repeats.

    Parameters
    ----------
    method : str
    labels, unlabelled : int
    noise, missing : float
        Of the protocol.
    repeats : int
        How many of them the method could run.
    rms, rms_se : float or None
        Mean over the repeats and its standard error; None where there is none (no repeat, or one).
    ratio_to_best : float or None
        `rms` over the least one of the methods that ran every repeat, on the same draws.
    rms_normalised, jitter, vertex_rms, vertex_p95, per_control
        Means of the measures of `facert.evaluation.metrics.Scores`.
    fit_seconds, frame_ms : float or None
        Training, and mapping one frame of many.
    failure : str
        Why the method could not run some repeat; empty when it ran all.
    """

    method: str
    labels: int
    unlabelled: int
    noise: float
    missing: float
    repeats: int
    rms: float | None
    rms_se: float | None
    ratio_to_best: float | None
    rms_normalised: float | None
    jitter: float | None
    vertex_rms: float | None
    vertex_p95: float | None
    per_control: tuple[float, ...]
    fit_seconds: float | None
    frame_ms: float | None
    failure: str = ""


def summarise(outcomes: Iterable[Outcome], protocol: Protocol) -> list[Row]:
    """Rows by rising labels, then unlabelled; within them the best method first, failures last."""
    groups: dict[tuple[int, int, str], list[Outcome]] = defaultdict(list)
    for outcome in sorted(outcomes, key=lambda outcome: outcome.cell.repeat):
        cell = outcome.cell
        groups[cell.labels, cell.unlabelled, cell.method].append(outcome)
    rows = [_row(members, protocol) for members in groups.values()]
    rows = [_with_ratio(row, rows) for row in rows]
    return sorted(rows, key=_rank)


def best(rows: Sequence[Row]) -> Row | None:
    """The row of least RMS among those without a failure."""
    complete = [row for row in rows if row.rms is not None and not row.failure]
    return min(complete, key=lambda row: row.rms or 0.0, default=None)


def _row(outcomes: Sequence[Outcome], protocol: Protocol) -> Row:
    cell = outcomes[0].cell
    ran = [outcome for outcome in outcomes if outcome.scores is not None]
    scores = [outcome.scores for outcome in ran if outcome.scores is not None]
    errors = np.array([s.rms for s in scores])
    return Row(
        method=cell.method,
        labels=cell.labels,
        unlabelled=cell.unlabelled,
        noise=protocol.noise,
        missing=protocol.missing,
        repeats=len(ran),
        rms=_mean(errors),
        rms_se=float(errors.std(ddof=1) / len(errors) ** 0.5) if len(errors) > 1 else None,
        ratio_to_best=None,
        rms_normalised=_mean_of(scores, lambda s: s.rms_normalised),
        jitter=_mean_of(scores, lambda s: s.jitter),
        vertex_rms=_mean_of(scores, lambda s: s.vertex_rms),
        vertex_p95=_mean_of(scores, lambda s: s.vertex_p95),
        per_control=tuple(np.mean([s.per_control for s in scores], axis=0)) if scores else (),
        fit_seconds=_mean(np.array([outcome.fit_seconds for outcome in ran])),
        frame_ms=_mean(np.array([outcome.frame_ms for outcome in ran])),
        failure=next((outcome.failure for outcome in outcomes if outcome.failure), ""),
    )


def _with_ratio(row: Row, rows: Sequence[Row]) -> Row:
    least = best([r for r in rows if (r.labels, r.unlabelled) == (row.labels, row.unlabelled)])
    if row.rms is None or least is None or not least.rms:
        return row
    return replace(row, ratio_to_best=row.rms / least.rms)


def _rank(row: Row) -> tuple[int, int, bool, float, str]:
    error = np.inf if row.rms is None else row.rms
    return row.labels, row.unlabelled, bool(row.failure), error, row.method


def _mean_of(scores: Sequence[Scores], measure: Callable[[Scores], float | None]) -> float | None:
    """Over the repeats in which there was something to measure."""
    values = [value for value in map(measure, scores) if value is not None]
    return _mean(np.array(values))


def _mean(values: FloatArray) -> float | None:
    return float(values.mean()) if len(values) else None
