"""The output of every command: results on stdout, everything else on stderr.

Names and whatever else comes from files are shown as text, whichever way they take: a console here
knows neither markup nor emoji codes, and escapes what would upset a terminal, also in tables.
"""

from __future__ import annotations

import logging
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from io import TextIOWrapper
from pathlib import Path
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from facert.data.subject import subject
from facert.data.text import printable_lines
from facert.errors import escaped


class _Console(Console):
    """Console that shows text as text.

    What to do when nobody reads its output is left to the command line.
    """

    def render_str(self, text: str, **options: Any) -> Text:
        """The text, escaped before a table measures it."""
        return super().render_str(
            printable_lines(text), **(options | {"markup": False, "emoji": False})
        )

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """The pieces of what is shown; what is no text of their own are rich's control codes."""
        for piece in super().render(renderable, options):
            yield piece if piece.control else piece._replace(text=printable_lines(piece.text))

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
        text = record.getMessage()
        if "\n" not in str(record.msg):  # else a name in it would begin a line of its own
            text = escaped(text)
        err.print(prefix + text, style="yellow" if warning else None)


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
    """Print a line of results; what would begin another line is escaped."""
    out.print(escaped(text))


def write(text: str) -> None:
    """Write text for programs, whole: JSON, TOML or a script, in which nothing is to be escaped."""
    if sys.stdout is not None:
        sys.stdout.write(text)
        sys.stdout.flush()


def cell(text: str) -> Text:
    """Foreign text for a cell of a table."""
    return Text(escaped(text))


class _LibrariesHandler(logging.Handler):
    """Log handler that makes what libraries log details of facert's own log."""

    def emit(self, record: logging.LogRecord) -> None:
        if not record.name.startswith("facert"):
            log.debug("%s: %s", record.name, record.getMessage())


def _log_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,  # noqa: ARG001  where Python would write it
    line: str | None = None,  # noqa: ARG001
) -> None:
    """Log a warning of Python code, as of an overflow: it is a detail, and no message to people."""
    log.debug("%s: %s (%s, line %d)", category.__name__, message, Path(filename).name, lineno)


def configure(quiet: bool, verbose: bool) -> None:
    """Send the package's log to stderr: warnings only, notes (default) or details.

    What libraries warn of is among the details.
    """
    show_any_letter()
    warnings.showwarning = _log_warning
    root = logging.getLogger()
    if not any(isinstance(handler, _LibrariesHandler) for handler in root.handlers):
        root.addHandler(_LibrariesHandler())
    log.handlers[:] = [_StderrHandler()]
    log.setLevel(logging.WARNING if quiet else logging.DEBUG if verbose else logging.INFO)


def like_here() -> Callable[[], None]:
    """What lets a worker process log as much as this one."""
    return partial(_configure_worker, log.level)


def _configure_worker(level: int) -> None:
    configure(quiet=False, verbose=False)
    log.setLevel(level)


def show_any_letter() -> None:
    """Let streams that know only some letters, as in the locale C, escape the others."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
