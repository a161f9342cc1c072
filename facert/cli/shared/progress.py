"""Training drawn on stderr: a bar on a terminal, nothing elsewhere."""

from __future__ import annotations

import logging
from types import TracebackType

from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from facert.cli.shared import console
from facert.models.optim.base import State
from facert.models.optim.monitor import Monitor


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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def iteration(self, state: State) -> None:
        """Show where the optimiser stands."""
        text = (
            f"iteration {state.iterations}   objective {state.value:.6g}   "
            f"gradient norm {state.gradient_norm:.2g}"
        )
        self._progress.update(self._task, description=text)
