"""Evaluate many cells: in processes, each on one thread, with finished cells kept."""

from __future__ import annotations

import hashlib
import logging
import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from itertools import product
from multiprocessing import active_children, connection, get_context, parent_process
from threading import Thread

import numpy as np

from facert.data.take import Take
from facert.data.version import VERSION
from facert.errors import FacertError
from facert.evaluation.cells import Cell, Outcome, evaluate
from facert.evaluation.protocol import Problem, draw
from facert.io.journal import Journal
from facert.settings import Settings

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Grid:
    """The cells of an evaluation: every combination of these.

    Parameters
    ----------
    methods : tuple of str
        Names in the registry.
    labels, unlabelled : tuple of int
        How many labelled frames; how many unlabelled frames, and as many poses.
    repeats : int
        Draws of each.
    """

    methods: tuple[str, ...]
    labels: tuple[int, ...]
    unlabelled: tuple[int, ...]
    repeats: int

    @property
    def cells(self) -> list[Cell]:
        """All of them, repeat by repeat, so that a part is a fair picture of the whole."""
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
) -> Iterator[Outcome]:
    """Evaluate the cells of a grid; outcomes come as they are done.

    Parameters
    ----------
    problem : Problem
    grid : Grid
    settings : Settings, optional
        How to train, apart from what a cell says.
    jobs : int
        Processes; 1 stays in this one. The outcomes do not depend on it, apart from the times.
    journal : Journal, optional
        Cells that it holds are not evaluated again; others are added to it, but for those that
        failed in a way that nobody foresaw: the next run tries them again.

    Raises
    ------
    InputError
        When the take is too short for the largest cell.
    FacertError
        When a process was killed.
    """
    for repeat in range(min(grid.repeats, 2)):  # the two halves of a split by blocks
        draw(problem, max(grid.labels), max(grid.unlabelled), repeat)
    settings = settings or Settings()
    cells = grid.cells
    kept = _kept(journal, set(cells))
    yield from kept
    done = {outcome.cell for outcome in kept}
    waiting = [cell for cell in cells if cell not in done]
    if min(jobs, len(waiting)) > 1:
        outcomes = _in_processes(problem, waiting, settings, jobs)
    else:
        outcomes = (evaluate(problem, cell, settings) for cell in waiting)
    for outcome in outcomes:
        if outcome.details:
            log.debug("%s\n%s", outcome.cell, outcome.details)
        elif journal is not None:
            journal.add(outcome.as_dict())
        yield outcome


def fingerprint(problem: Problem, settings: Settings | None = None) -> str:
    """What outcomes of cells depend on, apart from the cell: data, protocol, settings, version."""
    given = replace(settings or Settings(), method="", labels=None, unlabelled=0, seed=0)
    digest = hashlib.sha256(repr((VERSION, problem.protocol, problem.across, given)).encode())
    for take in (problem.take, problem.test):
        _add_take(digest, take)
    if problem.gram is not None:
        digest.update(problem.gram.tobytes())
    return digest.hexdigest()


def _kept(journal: Journal | None, wanted: set[Cell]) -> list[Outcome]:
    """The outcomes in the journal that belong to the grid."""
    if journal is None:
        return []
    try:
        outcomes = [Outcome.from_dict(entry) for entry in journal.begin()]
    except (TypeError, KeyError):
        log.warning("%s is damaged: begun anew", journal.path)
        journal.remove()
        journal.begin()
        return []
    kept = list({o.cell: o for o in outcomes if o.cell in wanted}.values())
    if kept:
        log.info("%d of %d cells are done, in %s", len(kept), len(wanted), journal.path)
    return kept


_shared: tuple[Problem, Settings]


def _in_processes(
    problem: Problem, cells: Sequence[Cell], settings: Settings, jobs: int
) -> Iterator[Outcome]:
    # Spawned: a fork would copy torch's thread pools in whatever state they are.
    strangers = set(active_children())
    pool = ProcessPoolExecutor(
        min(jobs, len(cells)), get_context("spawn"), _begin_process, (problem, settings)
    )
    try:
        for future in as_completed([pool.submit(_evaluate_shared, cell) for cell in cells]):
            yield future.result()
    except BrokenProcessPool:
        raise FacertError(
            "a process of the evaluation was killed; if for lack of memory, use fewer --jobs"
        ) from None
    except BaseException:
        # Not asked to end but ended: a second Ctrl-C while they finish would leave them hanging.
        for process in set(active_children()) - strangers:
            process.terminate()
        raise
    finally:
        pool.shutdown()


def _begin_process(problem: Problem, settings: Settings) -> None:
    """Once a process: the data stays in it, and Ctrl-C is for the parent to handle."""
    global _shared
    _shared = problem, settings
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A parent that was killed cannot tell its processes to end."""
    parent = parent_process()
    assert parent is not None  # this is a child
    connection.wait([parent.sentinel])
    os._exit(1)


def _evaluate_shared(cell: Cell) -> Outcome:
    problem, settings = _shared
    return evaluate(problem, cell, settings)


def _add_take(digest: hashlib._Hash, take: Take) -> None:
    digest.update(repr((take.source.names, take.controls and take.controls.names)).encode())
    limits = None if take.controls is None else take.controls.limits
    for array in (take.source.values, take.params, take.animation, limits):
        if array is not None:
            digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
