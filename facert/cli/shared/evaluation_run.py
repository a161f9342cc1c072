"""How ``facert eval`` runs its cells: kept where they can be, with a bar on a terminal."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

import facert
from facert.cli.shared import console
from facert.data.ranges import parse_range
from facert.data.text import plural
from facert.evaluation.cells import Outcome
from facert.evaluation.defaults import default_labels, default_unlabelled
from facert.evaluation.protocol import Problem
from facert.evaluation.run import Grid, fingerprint, run
from facert.io.journal import Journal, source_digest
from facert.settings import Settings

MANY = 250
"""With so many posed frames numbers need no word: they are those that the help tells."""


@dataclass(frozen=True)
class Asked:
    """What of a grid was asked for; None: whatever the take allows."""

    methods: tuple[str, ...]
    labels: tuple[int, ...] | None
    unlabelled: tuple[int, ...] | None
    repeats: int

    @classmethod
    def of(
        cls, methods: tuple[str, ...], labels: str | None, unlabelled: str | None, repeats: int
    ) -> Asked:
        """What the options say."""
        return cls(
            methods,
            None if labels is None else parse_range(labels, "--labels"),
            None if unlabelled is None else parse_range(unlabelled, "--unlabelled"),
            repeats,
        )

    def grid(self, problem: Problem) -> Grid:
        """The numbers that were asked for, else those that suit the take."""
        unlabelled = self.unlabelled or (default_unlabelled(problem),)
        labels = self.labels or default_labels(problem, max(unlabelled))
        posed = len(problem.take.labels)
        if max(labels) < posed < MANY and None in (self.labels, self.unlabelled):
            others = f"{plural(max(unlabelled), 'frame')} without a pose"
            numbers = " or ".join(map(str, labels))
            told = "learns from %s of %d posed frames and %s, tests on the rest"
            console.log.info(told, numbers, posed, others)
        return Grid(self.methods, labels, unlabelled, self.repeats)


def open_journal(problem: Problem, settings: Settings, json_path: Path | None) -> Journal | None:
    """Where finished cells are kept: beside the JSON file, if there is to be one."""
    if json_path is None:
        return None
    code = source_digest(Path(facert.__file__).parent)
    return Journal(json_path.with_suffix(".cells.jsonl"), fingerprint(problem, settings) + code)


def run_cells(
    problem: Problem, grid: Grid, settings: Settings, jobs: int | None, journal: Journal | None
) -> list[Outcome]:
    """Evaluate all cells; tells how to go on after Ctrl-C, and of failures nobody foresaw."""
    try:
        outcomes = run(problem, grid, settings, jobs or _cores(), journal)
        done = list(_watched(outcomes, len(grid.cells)))
    except KeyboardInterrupt:
        if journal is not None:
            console.log.warning("the same command continues from %s", journal.path)
        raise
    unforeseen = sum(bool(outcome.details) for outcome in done)
    if unforeseen:
        cells = plural(unforeseen, "cell")
        console.log.warning("%s failed unexpectedly: facert -v eval shows where", cells)
    return done


def _cores() -> int:
    """How many this process may use: fewer than there are in a container or on a cluster."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _watched(outcomes: Iterator[Outcome], total: int) -> Iterator[Outcome]:
    """A bar on a terminal; elsewhere a line for every tenth."""
    notes = console.log.isEnabledFor(logging.INFO)
    terminal = console.err.is_terminal
    columns = (BarColumn(), MofNCompleteColumn(), "cells", TimeRemainingColumn())
    bar = Progress(*columns, console=console.err, transient=True, disable=not (terminal and notes))
    with bar:
        task = bar.add_task("", total=total)
        for done, outcome in enumerate(outcomes, start=1):
            yield outcome
            bar.advance(task)
            if not terminal and 10 * done // total > 10 * (done - 1) // total:
                console.log.info("%d of %d cells", done, total)
