"""The output of every command: results on stdout, everything else on stderr."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console

from facert.data.subject import subject
from facert.errors import escaped


class _Console(Console):
    """Console that leaves what to do when nobody reads its output to the command line."""

    def on_broken_pipe(self) -> None:
        """Raise the `BrokenPipeError` that is being handled."""
        self.quiet = True
        raise


# Rich honours NO_COLOR and drops styles when the stream is not a terminal.
out = _Console(soft_wrap=True, highlight=False)
err = _Console(stderr=True, soft_wrap=True, highlight=False)

log = logging.getLogger("facert")


class _StderrHandler(logging.Handler):
    """Log handler with one line a record; Rich's own would cut long lines at 80 columns."""

    def emit(self, record: logging.LogRecord) -> None:
        warning = record.levelno >= logging.WARNING
        prefix = "warning: " if warning else ""
        prefix += f"{escaped(subject())}: " if subject() else ""
        lines = map(escaped, self.format(record).split("\n"))  # names in it may be foreign
        err.print(prefix + "\n".join(lines), style="yellow" if warning else None, markup=False)


def _is_not_judged(record: logging.LogRecord) -> bool:
    return not getattr(record, "judged", False)


@contextmanager
def without_judged() -> Iterator[None]:
    """Leave out lines of the log that the verdict in the end will hold."""
    handlers = list(log.handlers)
    for handler in handlers:
        handler.addFilter(_is_not_judged)
    try:
        yield
    finally:
        for handler in handlers:
            handler.removeFilter(_is_not_judged)


_FIGURES = {
    "seconds": "training seconds",
    "motion a frame": "motion per frame",
    "cross-validation error": "error at poses left out",
}


def figure_label(name: str) -> str:
    """A figure of a model, with its unit if it has one, by the name that people are shown."""
    figure, comma, unit = name.partition(", ")
    return f"{_FIGURES.get(figure, figure)}{comma}{unit}"


def show(text: str) -> None:
    """Print a line of results as it is: what stands in brackets is no markup."""
    out.print(text, markup=False)


def configure(quiet: bool, verbose: bool) -> None:
    """Send the package's log to stderr: warnings only, notes (default) or details."""
    log.handlers[:] = [_StderrHandler()]
    log.setLevel(logging.WARNING if quiet else logging.DEBUG if verbose else logging.INFO)
