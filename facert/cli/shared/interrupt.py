"""Interruption of commands that run until they are asked to end."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event
from types import FrameType
from typing import Any

from facert.cli.shared import console


@contextmanager
def interruptible() -> Iterator[Event]:
    """An event that Ctrl-C, or a request to end, sets; a second Ctrl-C stops at once."""
    asked = Event()
    before: dict[int, Any] = {}

    def stop(number: int, _frame: FrameType | None) -> None:
        asked.set()
        signal.signal(number, before[number] or signal.SIG_DFL)

    for one in (signal.SIGINT, signal.SIGTERM):
        before[one] = signal.signal(one, stop)
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def wait_for_end(page: str) -> None:
    """Print the address of a page, and serve it until Ctrl-C."""
    console.show(f"{page} (Ctrl-C ends it)")
    with interruptible() as asked:
        asked.wait()
