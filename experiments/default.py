"""Is the default the method to use? `auto` against every other, on all tracks, cell by cell.

    python -m experiments.default [--repeats 10] [--jobs 2] [--methods auto ssgpr ridge]
    python -m experiments.default --split block
    python -m experiments.default --split across

A cell is a track with a target, a noise and a number of labels; all methods meet the same draws and
are clipped to the same limits. Markers come as they are, and those of the simulated tracks with
noise of 0.05 of the largest deviation as well. With `--split block`, or `across` takes of one
actor, without noise. Tables and every mean go into experiments/results; finished cells are kept
in build/cells: the same command continues an interrupted run.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from experiments.grid import ACROSS, DEFAULT, OPTICAL, Case, begin_log, evaluate, kinds, options
from experiments.report import markdown, with_error, write_csv, write_text
from experiments.verdict import Cell, common_others, judge, lead, mean_ratio
from facert.evaluation.paired import MeanWithError, errors_by_method
from facert.evaluation.run import Grid

LABELS = (10, 15, 20, 30, 40)
UNLABELLED = 100
NOISE = 0.05

Groups = dict[str, list[Cell]]


def main() -> None:
    parser = options(__doc__, repeats=10)
    parser.add_argument("--split", choices=("random", "block", "across"), default="random")
    given = parser.parse_args()
    if given.repeats < 2:
        parser.error("--repeats: standard errors take two at least")
    cases = cases_of(given)
    if not cases:
        parser.error(f"--split across: for {' and '.join(ACROSS)} alone")
    begin_log()
    cells = [cell for case in cases for cell in measure(case, given)]
    groups = groups_of(cells)
    parts = [
        f"# The default, {given.split} split",
        f"`{DEFAULT}` against the other methods, {given.repeats} draws a cell, {UNLABELLED} "
        "unlabelled frames and poses. *Best single*: the other method against which the mean ratio "
        "is highest. *Best of each*: the method of least RMS in each cell; *lost*: cells where it "
        "is ahead by more than the standard error of the paired difference. *Less SE*: less the "
        "standard error of the paired ratio.",
        verdicts(groups),
        f"## RMS of {DEFAULT} over that of each method, mean over the cells",
        ratios(groups),
        "## Order of the methods",
        "By the geometric mean over labels and draws; its standard error is that between draws.",
        orders(groups_by(cells, lambda cell: cell.case.name)),
        "## Cell by cell",
        each_cell(cells),
    ]
    write_text(given.results / f"default_{given.split}.md", parts)
    write_csv(given.results / f"default_{given.split}.csv", records(cells))
    print("\n".join(parts[2:-2]))
    print(f"all cells: {given.results}/default_{given.split}.md and .csv")


def cases_of(given: Namespace) -> list[Case]:
    """The problems of a kind of split."""
    pairs = kinds(given.tracks)
    if given.split == "across":
        pairs = [(track, target) for track, target in pairs if track in ACROSS]
    cases = [Case(*pair, given.split, test_frames=given.test_frames) for pair in pairs]
    if given.split != "random":
        return cases
    return cases + [replace(c, noise=NOISE) for c in cases if c.track not in OPTICAL]


def measure(case: Case, given: Namespace) -> list[Cell]:
    """Evaluate a problem at every number of labels."""
    methods = dict.fromkeys((DEFAULT, *given.methods))
    grid = Grid(tuple(methods), LABELS, (UNLABELLED,), given.repeats)
    outcomes = evaluate(case, grid, given.jobs)
    cells = []
    for labels in LABELS:
        members = [outcome for outcome in outcomes if outcome.cell.labels == labels]
        errors = {method: table[0] for method, table in errors_by_method(members).items()}
        cells.append(Cell(case, labels, errors))
        reasons = {f"{o.cell.method}: {o.failure}" for o in members if o.failure}
        for reason in sorted(reasons):
            print(f"{cells[-1].name}: left out, {reason}")
        if DEFAULT not in errors or len(errors) < 2:
            sys.exit(f"{cells[-1].name}: {DEFAULT} and another method must run every draw")
    return cells


def groups_of(cells: Sequence[Cell]) -> Groups:
    """All cells, and those of each target, noise and number of labels, where these differ."""
    groups = {"all": list(cells)}
    for parts in (
        groups_by(cells, lambda cell: cell.case.target),
        groups_by(cells, lambda cell: f"noise {cell.case.noise:g}"),
        groups_by(cells, lambda cell: f"{cell.labels} labels"),
    ):
        groups |= parts if len(parts) > 1 else {}
    return groups


def groups_by(cells: Sequence[Cell], key: Callable[[Cell], str]) -> Groups:
    """Cells by what they have in common."""
    groups: Groups = {}
    for cell in cells:
        groups.setdefault(key(cell), []).append(cell)
    return groups


def verdicts(groups: Groups) -> str:
    """A line for each group."""
    lines = []
    for name, cells in groups.items():
        found = judge(cells)
        lines.append(
            [
                name,
                str(found.cells),
                f"{found.against_single:.3f} ({found.single})",
                f"{found.mean:.3f}",
                f"{found.worst:.3f}",
                f"{found.worst_beyond:.3f} ({found.where})",
                f"{found.beaten}",
            ]
        )
    header = [
        "cells",
        "number",
        "/ best single",
        "/ best of each",
        "worst",
        "worst less SE",
        "lost",
    ]
    return markdown(header, lines)


def ratios(groups: Groups) -> str:
    """The default over each method, group by group."""
    methods = common_others(groups["all"])
    methods.sort(key=lambda method: -mean_ratio(groups["all"], method))
    lines = [
        [method, *(f"{mean_ratio(cells, method):.3f}" for cells in groups.values())]
        for method in methods
    ]
    return markdown([f"{DEFAULT} /", *groups], lines)


def orders(problems: Groups) -> str:
    """For each problem the methods in order, and how far the default is from the best other."""
    lines = []
    everything = [cell for cells in problems.values() for cell in cells]
    for name, cells in {**problems, "all": everything}.items():
        leads = {method: lead(cells, method) for method in common_others(cells)}
        order = sorted([DEFAULT, *leads], key=lambda m: -leads[m].value if m in leads else 0.0)
        best = next(method for method in order if method != DEFAULT)
        ratio, se = np.exp(leads[best].value), leads[best].se
        lines.append(
            [name, " < ".join(order), f"{with_error(MeanWithError(ratio, ratio * se))} ({best})"]
        )
    return markdown(["problem", "methods by rising RMS", f"{DEFAULT} / best other"], lines, texts=2)


def each_cell(cells: Sequence[Cell]) -> str:
    """The default and the best other, cell by cell."""
    lines = []
    for cell in cells:
        best = cell.others[0]
        means = [float(cell.errors[method].mean()) for method in (DEFAULT, best)]
        ratio = cell.ratio(best)
        lines.append(
            [
                cell.name,
                f"{means[0]:.4f}",
                f"{means[1]:.4f} ({best})",
                with_error(ratio),
            ]
        )
    return markdown(["cell", DEFAULT, "best other", "ratio"], lines)


def records(cells: Sequence[Cell]) -> list[dict[str, object]]:
    """A line of the CSV file for each cell and method."""
    lines: list[dict[str, object]] = []
    for cell in cells:
        for method, errors in cell.errors.items():
            mean = MeanWithError.of(errors)
            difference, ratio = cell.difference(method), cell.ratio(method)
            lines.append(
                {
                    "track": cell.case.track,
                    "target": cell.case.target,
                    "split": cell.case.split,
                    "noise": cell.case.noise,
                    "labels": cell.labels,
                    "unlabelled": UNLABELLED,
                    "method": method,
                    "repeats": len(errors),
                    "rms": mean.value,
                    "rms_se": mean.se,
                    "default_minus_method": difference.value,
                    "default_minus_method_se": difference.se,
                    "default_over_method": ratio.value,
                    "default_over_method_se": ratio.se,
                }
            )
    return lines


if __name__ == "__main__":
    main()
