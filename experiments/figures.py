"""Figures 4 and 5 of Bouaziz and Pauly (2014), for every track and target.

    python -m experiments.figures [--jobs 2] [--repeats 20] [--tracks rom utterance_a]

Figure 4 is the RMS against the number of labels, of all methods; Figure 5 that of the
semi-supervised ones against the number of unlabelled frames, with 10 labels; the supervised ones,
which do not use such frames, are horizontal lines. Pictures, tables and every mean go into
experiments/results. Finished cells are kept in build/cells: the same command continues an
interrupted run.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from experiments.drawing import Panel, draw_panels, rms_of, save
from experiments.grid import Case, begin_log, evaluate, kinds, options
from experiments.report import markdown, write_csv, write_text
from facert.evaluation.run import Grid
from facert.evaluation.table import EvaluationRow, best, summarise

LABELS = (10, 20, 30, 40)
FEWEST = LABELS[0]
UNLABELLED = (0, 50, 100, 150, 200)
USUAL = 100
SEMI_SUPERVISED = ("ssgplvm", "ssgpr", "auto")
LEFT_OUT = {"per_control", "noise", "missing", "vertex_rms", "vertex_p95", "ratio_to_best"}


@dataclass(frozen=True)
class Curves:
    """The means of a problem: rows of both figures, and the supervised methods of Figure 5."""

    case: Case
    labels: Sequence[EvaluationRow]
    unlabelled: Sequence[EvaluationRow]
    references: Sequence[EvaluationRow]


def measure(case: Case, given: Namespace) -> Curves:
    """Evaluate both grids of a problem."""
    semi = tuple(method for method in given.methods if method in SEMI_SUPERVISED)
    grid = Grid(tuple(given.methods), LABELS, (USUAL,), given.repeats)
    by_labels = summarise(evaluate(case, grid, given.jobs), case.protocol)
    by_unlabelled: list[EvaluationRow] = []
    if semi:
        grid = Grid(semi, (FEWEST,), UNLABELLED, given.repeats)
        by_unlabelled = summarise(evaluate(case, grid, given.jobs), case.protocol)
    return Curves(
        case,
        _measured(by_labels),
        _measured(by_unlabelled),
        [row for row in _measured(by_labels) if row.labels == FEWEST and row.method not in semi],
    )


def figure_4(curves: Sequence[Curves], repeats: int, folder: Path) -> None:
    """RMS against labels."""
    panels = [Panel(c.case.name, c.labels) for c in curves]
    title = f"Figure 4: RMS against labels, {USUAL} unlabelled frames and poses, {repeats} draws"
    save(draw_panels(panels, "labels", title), folder / "figure4.png")
    write_csv(folder / "figure4.csv", [_record(c.case, row) for c in curves for row in c.labels])
    parts = [
        "# RMS against labels",
        f"{title}; mean ± standard error; the least of a column in bold.",
    ]
    for c in curves:
        parts += [f"## {c.case.name}", _table(c.labels, "labels", lambda row: row.labels)]
    parts += [
        "## All of them",
        "Geometric mean over the problems above of the RMS over the least in its column there.",
        _overall([c.labels for c in curves]),
    ]
    write_text(folder / "figure4.md", parts)


def figure_5(curves: Sequence[Curves], repeats: int, folder: Path) -> None:
    """RMS against unlabelled frames."""
    panels = [Panel(c.case.name, c.unlabelled, c.references) for c in curves]
    title = f"Figure 5: RMS against unlabelled frames and poses, {FEWEST} labels, {repeats} draws"
    save(draw_panels(panels, "unlabelled", title), folder / "figure5.png")
    write_csv(
        folder / "figure5.csv",
        [_record(c.case, row) for c in curves for row in (*c.unlabelled, *c.references)],
    )
    parts = [
        "# RMS against unlabelled frames",
        f"{title}; mean ± standard error; the least of a column in bold. The other methods do not "
        f"learn from such data; theirs is the RMS of Figure 4, with poses clipped to the range of "
        f"{USUAL} unlabelled ones.",
    ]
    for c in curves:
        others = sorted((rms_of(row), row.method) for row in c.references)
        parts += [
            f"## {c.case.name}",
            _table(c.unlabelled, "unlabelled", lambda row: row.unlabelled),
            "Without them: " + ", ".join(f"{name} {error:.4f}" for error, name in others) + ".",
        ]
    write_text(folder / "figure5.md", parts)


def _table(rows: Sequence[EvaluationRow], name: str, number: Callable[[EvaluationRow], int]) -> str:
    """Methods by rising mean, down; the number across."""
    numbers = sorted({number(row) for row in rows})
    found = {(row.method, number(row)): row for row in rows}
    least = {n: best([row for row in rows if number(row) == n]) for n in numbers}
    lines = []
    for method in _ranked(rows):
        cells = [found.get((method, n)) for n in numbers]
        texts = [_cell(row, row is least[n]) for row, n in zip(cells, numbers, strict=True)]
        lines.append([method, *texts])
    return markdown([name, *map(str, numbers)], lines)


def _cell(row: EvaluationRow | None, bold: bool) -> str:
    if row is None:
        return "-"
    text = f"{rms_of(row):.4f}" + (f" ± {row.rms_se:.4f}" if row.rms_se is not None else "")
    return f"**{text}**" if bold else text


def _ranked(rows: Sequence[EvaluationRow]) -> list[str]:
    def mean(method: str) -> float:
        return float(np.mean([np.log(rms_of(row)) for row in rows if row.method == method]))

    return sorted({row.method for row in rows}, key=mean)


def _overall(problems: Sequence[Sequence[EvaluationRow]]) -> str:
    """Geometric means of the ratio to the best, method by method."""
    rows = [row for problem in problems for row in problem]

    def ratio(method: str, labels: Sequence[int]) -> float:
        chosen = [row for row in rows if row.method == method and row.labels in labels]
        return float(np.exp(np.mean([np.log(row.ratio_to_best or np.nan) for row in chosen])))

    complete = len(problems) * len(LABELS)
    methods = [m for m in _ranked(rows) if sum(row.method == m for row in rows) == complete]
    lines = [
        [method, *(f"{ratio(method, [n]):.3f}" for n in LABELS), f"{ratio(method, LABELS):.3f}"]
        for method in sorted(methods, key=lambda method: ratio(method, LABELS))
    ]
    return markdown(["labels", *map(str, LABELS), "all"], lines)


def _measured(rows: Sequence[EvaluationRow]) -> list[EvaluationRow]:
    return [row for row in rows if row.rms is not None]


def _record(case: Case, row: EvaluationRow) -> dict[str, object]:
    """A line of the CSV file."""
    values = {name: value for name, value in asdict(row).items() if name not in LEFT_OUT}
    problem = {"track": case.track, "target": case.target, "split": case.split}
    return {**problem, "noise": case.noise, **values}


def main() -> None:
    given = options(__doc__, repeats=20).parse_args()
    begin_log()
    cases = [Case(*kind, test_frames=given.test_frames) for kind in kinds(given.tracks)]
    curves = [measure(case, given) for case in cases]
    figure_4(curves, given.repeats, given.results)
    if any(c.unlabelled for c in curves):
        figure_5(curves, given.repeats, given.results)
    print((given.results / "figure4.md").read_text(encoding="utf-8").split("## All of them")[1])
    print(f"figures and tables: {given.results}")


if __name__ == "__main__":
    main()
