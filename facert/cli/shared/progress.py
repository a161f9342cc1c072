"""Long work drawn on stderr: a bar on a terminal."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from typing import TypeVar

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from facert.cli.shared import console
from facert.models.optim.monitor import Monitor
from facert.models.optim.optimiser import State

Thing = TypeVar("Thing")


def watched(things: Iterable[Thing], total: int, noun: str) -> Iterator[Thing]:
    """Iterate and show progress: a bar on a terminal, elsewhere a note for every tenth."""
    notes, terminal = console.log.isEnabledFor(logging.INFO), console.err.is_terminal
    columns = (BarColumn(), MofNCompleteColumn(), noun, TimeRemainingColumn())
    hidden = not (terminal and notes)
    with Progress(*columns, console=console.err, transient=True, disable=hidden) as bar:
        task = bar.add_task("", total=total)
        for done, thing in enumerate(things, start=1):
            yield thing
            bar.advance(task)
            if not terminal and 10 * done // total > 10 * (done - 1) // total:
                console.log.info("%d of %d %s", done, total, noun)


class ProgressBar(Monitor):
    """Shows iteration, objective and gradient norm while it is entered."""

    def __init__(self) -> None:
        shown = console.err.is_terminal and console.log.isEnabledFor(logging.INFO)
        columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        self._progress = Progress(*columns, console=console.err, transient=True, disable=not shown)
        self._task = self._progress.add_task("training")

    def __enter__(self) -> ProgressBar:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def iteration(self, state: State) -> None:
        """Show where the optimiser stands."""
        text = (
            f"iteration {state.iterations}   objective {state.value:.6g}   "
            f"gradient norm {state.gradient_norm:.2g}"
        )
        self._progress.update(self._task, description=text)
