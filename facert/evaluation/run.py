"""Evaluate many cells: in processes, each on one thread, with finished cells kept."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.take import Take
from facert.data.version import VERSION
from facert.errors import InputError
from facert.evaluation.cells import Cell, Outcome, evaluate
from facert.evaluation.processes import call_each
from facert.evaluation.protocol import Problem, draw
from facert.io.journal import Journal, source_digest
from facert.settings import Settings

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Grid:
    """The cells of an evaluation: every combination of these."""

    methods: tuple[str, ...]  # Names in the registry
    # How many labelled frames; how many unlabelled frames, and as many poses
    labels: tuple[int, ...]
    unlabelled: tuple[int, ...]
    repeats: int  # Draws of each

    def __len__(self) -> int:
        """Number of cells."""
        return self.repeats * len(self.labels) * len(self.unlabelled) * len(self.methods)

    @property
    def cells(self) -> list[Cell]:
        """All cells in order of repeats, so that a part is a fair picture of the whole."""
        return [
            Cell(method, labels, unlabelled, repeat)
            for repeat, labels, unlabelled, method in product(
                range(self.repeats), self.labels, self.unlabelled, self.methods
            )
        ]


def run(
    problem: Problem,
    grid: Grid,
    settings: Settings | None = None,
    jobs: int = 1,
    journal: Journal | None = None,
    begin: Callable[[], object] | None = None,
) -> Iterator[Outcome]:
    """Evaluate the cells of a grid; outcomes come as they are done.

    Parameters
    ----------
    problem : Problem
    grid : Grid
    settings : Settings, optional
        How to train, but for what is the cell's.
    jobs : int
        Processes; 1 stays in this one. The outcomes do not depend on it, apart from the times.
    journal : Journal, optional
        Cells that it holds are not evaluated again; others are added to it, but for those that
        failed unexpectedly: the next run tries them again.
    begin : callable, optional
        Called first in every process of its own.

    Raises
    ------
    InputError
        When the take is too short for the largest cell.
    """
    for repeat in range(min(grid.repeats, 2)):  # the two halves of a split by blocks
        draw(problem, max(grid.labels), max(grid.unlabelled), repeat)
    settings = settings or Settings()
    cells = grid.cells
    kept = _kept(journal, set(cells))
    yield from kept
    done = {outcome.cell for outcome in kept}
    waiting = [cell for cell in cells if cell not in done]
    calls = [(problem, cell, settings) for cell in waiting]
    for outcome in call_each(evaluate, calls, jobs, begin, _lost):
        if outcome.details:
            log.debug("%s\n%s", outcome.cell, outcome.details)
        elif journal is not None:
            journal.add(outcome.as_dict())
        yield outcome


def journal_beside(path: Path, problem: Problem, settings: Settings) -> Journal:
    """The journal of finished cells, beside the file of the results."""
    code = source_digest(Path(__file__).parents[1])
    return Journal(path.with_suffix(".cells.jsonl"), fingerprint(problem, settings) + code)


def fingerprint(problem: Problem, settings: Settings | None = None) -> str:
    """Digest of all that outcomes depend on but the cell: data, protocol, settings, version."""
    given = replace(settings or Settings(), method="", labels=None, unlabelled=0, seed=0)
    digest = hashlib.sha256(repr((VERSION, problem.protocol, problem.across, given)).encode())
    for take in (problem.take, problem.test):
        _add_take(digest, take)
    digest.update(problem.borders.tobytes())
    if problem.gram is not None:
        digest.update(problem.gram.tobytes())
    return digest.hexdigest()


def _kept(journal: Journal | None, wanted: set[Cell]) -> list[Outcome]:
    """The outcomes in the journal that belong to the grid."""
    if journal is None:
        return []
    outcomes = [o for entry in journal.begin() if (o := _outcome(entry, journal.path))]
    kept = list({o.cell: o for o in outcomes if o.cell in wanted}.values())
    if kept:
        log.info("%d of %d cells are done, in %s", len(kept), len(wanted), journal.path)
    return kept


def _outcome(entry: dict[str, Any], path: Path) -> Outcome | None:
    """The outcome of an entry; None where its fields are damaged: that cell alone is done again."""
    try:
        return Outcome.from_dict(entry)
    except InputError as error:
        log.warning("%s: passed over a damaged cell: %s", path, error)
        return None


def _lost(_problem: Problem, cell: Cell, _settings: Settings, reason: str) -> Outcome:
    """The outcome of a cell whose process died; it is tried again by the next run."""
    return Outcome(cell, failure=reason, details=reason)


def _add_take(digest: hashlib._Hash, take: Take) -> None:
    digest.update(repr((take.source.names, take.controls and take.controls.names)).encode())
    limits = None if take.controls is None else take.controls.limits
    for array in (take.source.values, take.params, take.animation, limits):
        if array is not None:
            digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
