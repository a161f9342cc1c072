"""The file that the work at hand is about, for messages about one of several."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar

from facert.errors import reading

_subject: ContextVar[str] = ContextVar("subject", default="")


@contextmanager
def about(name: str) -> Iterator[None]:
    """Name a file in every error that is raised inside, and let the log name it; not for "".

    Who shows the log asks `subject` for it.
    """
    token = _subject.set(name or _subject.get())
    try:
        with reading(name) if name else nullcontext():
            yield
    finally:
        _subject.reset(token)


def subject() -> str:
    """The file that the work at hand is about; empty where it needs no name."""
    return _subject.get()
