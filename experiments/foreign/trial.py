"""One file of another program: how it is made, read and compared."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from facert.errors import FacertError


@dataclass(frozen=True)
class Trial:
    """A file that a program writes, and the largest difference after it was read."""

    program: str
    file: str
    compared: str
    difference: Callable[[Path], float]
    """Makes the file in a folder, reads it, and returns how far a value is off."""
    tolerance: float = 1e-6


@dataclass(frozen=True)
class Outcome:
    """A trial and its result: the difference, or what went wrong."""

    trial: Trial
    found: float | str
    messages: tuple[str, ...]

    @property
    def good(self) -> bool:
        """Whether the file was read, and nothing is off by more than the tolerance."""
        return isinstance(self.found, float) and self.found <= self.trial.tolerance

    def row(self) -> list[str]:
        """The cells of the table."""
        found = f"{self.found:.1e}" if isinstance(self.found, float) else self.found
        shown = found if self.good else f"**{found}**"
        return [self.trial.program, self.trial.file, self.trial.compared, shown]


class _Messages(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


@contextmanager
def messages() -> Iterator[list[str]]:
    """What facert logs inside of the block."""
    log, handler = logging.getLogger("facert"), _Messages()
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield handler.lines
    finally:
        log.removeHandler(handler)
        log.setLevel(level)


def carried_out(trial: Trial, folder: Path) -> Outcome:
    """Carry a trial out in a new folder; whatever goes wrong in it is its outcome."""
    folder.mkdir(parents=True, exist_ok=True)
    found: float | str
    with messages() as lines:
        try:
            found = trial.difference(folder)
        except FacertError as error:
            found = _in_one_line(f"refused: {error}")
        except Exception as error:
            found = _in_one_line(f"{type(error).__name__}: {error}")
    return Outcome(trial, found, tuple(lines))


def _in_one_line(text: str) -> str:
    return " ".join(text.replace("|", "/").split())
