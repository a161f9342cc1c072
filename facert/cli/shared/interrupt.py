"""Commands that run until they are asked to end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event

from facert.cli.shared import console
from facert.cli.shared.signals import signals


@contextmanager
def interruptible() -> Iterator[Event]:
    """An event that Ctrl-C, or a request to end, sets; a second one stops at once."""
    asked = Event()
    with signals.setting(asked):
        yield asked


def wait_for_end(page: str) -> None:
    """Print the address of a page, and serve it until Ctrl-C."""
    console.show(f"{page} (Ctrl-C ends it)")
    with interruptible() as asked:
        asked.wait()
