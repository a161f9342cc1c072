"""Status of a live session: a line on the terminal, or in the log now and then; a summary."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.live import Live

from facert.cli.shared import console
from facert.data.text import for_json
from facert.live.frames import Counters
from facert.live.loop import LiveSession
from facert.live.timing import RECENT, Pace

ON_TERMINAL = 0.25
"""Seconds between two status lines that replace each other."""
IN_LOG = 10.0
"""Seconds between two status lines that stay."""
_QUIET = 2.0


class Status:
    """Shows how the session goes, while it is entered."""

    def __init__(self, session: LiveSession) -> None:
        wanted = console.log.isEnabledFor(logging.INFO)
        self._session = session
        self._live = Live(console=console.err, auto_refresh=False, transient=True)
        self._on_terminal = wanted and console.err.is_terminal
        self._every = ON_TERMINAL if self._on_terminal else IN_LOG
        self._next = time.monotonic() + self._every
        self._seen, self._seen_at = -1, 0.0

    def __enter__(self) -> Status:
        if self._on_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._on_terminal:
            self._live.stop()

    def show(self) -> None:
        """Show the line if it is time."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + self._every
        line = self._line(now)
        if self._on_terminal:
            self._live.update(line, refresh=True)
        else:
            console.log.info("%s", line)

    def _line(self, now: float) -> str:
        counters = self._session.counters
        if counters.received != self._seen:
            self._seen, self._seen_at = counters.received, now
        waiting = not counters.received or now - self._seen_at > _QUIET
        pace = "waits for frames" if waiting else _pace(self._session.meter.pace(RECENT))
        return f"{pace}   {_counts(counters)}"


def print_summary(session: LiveSession, written: Sequence[Path], as_json: bool) -> None:
    """Print the summary of a session on stdout."""
    pace = session.meter.pace()
    if as_json:
        console.write(for_json(_facts(session.counters, pace, written)) + "\n")
        return
    if session.counters.mapped:
        console.out.print(_pace(pace))
    console.out.print(f"{session.counters.received} received, {_counts(session.counters)}")
    for path in written:
        console.show(f"wrote {path}")


def _pace(pace: Pace) -> str:
    rate = f"{pace.rate:.1f} frames/s, " if math.isfinite(pace.rate) else ""
    return f"{rate}latency {pace.median:.2f} ms, p99 {pace.p99:.2f} ms"


def _counts(counters: Counters) -> str:
    """Text of the counters: those that every session has, and others that are not 0."""
    always = f"{counters.mapped} mapped, {counters.dropped} dropped, {counters.bad} bad"
    others = {
        "late or double": counters.late,
        "without a face": counters.hidden,
        "with unknown names": counters.unknown,
        "without a pose": counters.failed,
        "not sent": counters.unsent,
        "refused by the receiver": counters.refused,
    }
    return ", ".join([always, *(f"{count} {name}" for name, count in others.items() if count)])


def _facts(counters: Counters, pace: Pace, written: Sequence[Path]) -> dict[str, Any]:
    latency = {"median": pace.median, "p99": pace.p99, "worst": pace.worst}
    return {
        **asdict(counters),
        "rate": _plain(pace.rate),
        "latency_ms": {name: _plain(value) for name, value in latency.items()},
        "files": [str(path) for path in written],
    }


def _plain(value: float) -> float | None:
    """The value, or None for NaN and infinity, which JSON does not have."""
    return value if math.isfinite(value) else None
