"""The errors that facert raises, under one parent.

A message names the file or argument, the field, what was expected, what was found, and the fix.
Each class carries the exit status that the command line returns for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MOST = 120
"""Most characters of what an `InputError` says of a field, or of what was expected or found."""


class FacertError(Exception):
    """Parent of every error that facert raises on purpose."""

    exit_code = 1


class InputError(FacertError):
    """A file or an argument does not hold what it should.

    Parameters
    ----------
    field : str
        The part of the input that is at fault, e.g. ``"/target/params"``.
    expected, found : str
        What the field should hold, and what it holds.
    fix : str
        What the user can do about it.
    where : str, optional
        The file or argument; readers that know it later add it with `reading`.
    """

    exit_code = 3

    def __init__(
        self, field: str, expected: str, found: str, fix: str, where: str | None = None
    ) -> None:
        super().__init__(field, expected, found, fix, where)
        self.field, self.expected, self.found, self.fix = field, expected, found, fix
        self.where = where

    def __str__(self) -> str:
        """One line: ``where: field: expected ..., found .... Fix.``."""
        where = f"{self.where}: " if self.where else ""
        field, expected, found = map(_shortened, (self.field, self.expected, self.found))
        fix = _shortened(self.fix, 10 * MOST)  # it may list what there is
        line = f"{where}{field}: expected {expected}, found {found}. {fix}"
        return escaped(" ".join(line.split()))


def _shortened(text: str, most: int = MOST) -> str:
    return text if len(text) <= most else f"{text[:most]}[...]"


def escaped(text: str) -> str:
    """The text with escapes for what would upset a terminal."""
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in text)


class OutputExistsError(FacertError):
    """The output file exists and ``--overwrite`` was not given.

    Parameters
    ----------
    path : Path
        The file.
    problem : str, optional
        What is the matter with it.
    fix : str, optional
        What the user can do about it.
    """

    exit_code = 2

    def __init__(
        self,
        path: Path,
        problem: str = "the file exists",
        fix: str = "Give another name, or --overwrite.",
    ) -> None:
        super().__init__(path, problem, fix)
        self.path, self.problem, self.fix = path, problem, fix

    def __str__(self) -> str:
        """One line: ``path: problem. Fix.``."""
        return escaped(f"{self.path}: {self.problem}. {self.fix}")


class OutputKeptError(OutputExistsError):
    """The output file exists and is never replaced, not even with ``--overwrite``.

    Parameters
    ----------
    path : Path
        The file.
    problem : str, optional
        Why it is kept.
    """

    exit_code = 3

    def __init__(self, path: Path, problem: str = "the file was not written by facert") -> None:
        fix = "Give another name, or delete it yourself."
        super().__init__(path, f"{problem}: it is never replaced", fix)


class NumericalError(FacertError):
    """A computation has no finite answer, e.g. a matrix is not positive definite."""


class DeviceError(FacertError):
    """The device that was asked for is not there."""

    exit_code = 2


@contextmanager
def reading(where: str | Path) -> Iterator[None]:
    """Name the file in every `InputError` that is raised inside."""
    try:
        yield
    except InputError as error:
        if error.where is None:
            error.where = str(where)
        raise
