"""Timing of a session: when the next frame is due, and how fast frames are mapped."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

EARLY = 0.75
"""Share of the usual gap between two frames after which the next one may come any moment."""
EVERY = 0.001
"""Seconds after which what was rehearsed is cold again: other programs use the caches as well."""
SHARE = 0.25
"""Largest share of the time that rehearsals take while a frame may come any moment."""
SILENCE = 0.25
"""Seconds without a frame after which none is expected."""
KEPT = 2**16
"""Frames that the figures of a whole session go back to: nine minutes at 120 frames/s."""
RECENT = 512
"""Frames that the status line looks at."""
_GAP_MEMORY, _COST_MEMORY = 0.9, 0.95  # of exponential smoothing


class Rhythm:
    """The gap between frames, smoothed, and so when the next one is due."""

    def __init__(self) -> None:
        self._last, self._gap = -math.inf, 0.0

    def add(self, arrived: float) -> None:
        """Count a frame by the second of its arrival."""
        gap, self._last = arrived - self._last, arrived
        if gap < SILENCE:
            self._gap = _GAP_MEMORY * self._gap + (1.0 - _GAP_MEMORY) * gap

    def until_ready(self, now: float, cost: float) -> float:
        """Seconds until a rehearsal that takes `cost` is due; infinite in a silence."""
        if now - self._last >= SILENCE:
            return math.inf
        return max(self._last + EARLY * self._gap - now, EVERY, cost / SHARE)


@dataclass(frozen=True)
class Pace:
    """Rate and latency of some frames."""

    rate: float
    """Frames a second; NaN before there are two."""
    median: float
    p99: float
    worst: float
    """Latency in milliseconds, from a packet's arrival in the process until its pose is sent; NaN
    before there is one."""


class Meter:
    """Arrival and latency of the latest frames, in memory that does not grow."""

    def __init__(self) -> None:
        self._arrived = np.empty(KEPT)
        self._spent = np.empty(KEPT)
        self._count = 0
        self.cost = 0.0
        """Seconds that mapping and sending a frame takes, smoothed."""

    def add(self, arrived: float, begun: float, sent: float) -> None:
        """Count a frame by the seconds of its arrival, of its turn, and of its end."""
        row = self._count % KEPT
        self._arrived[row], self._spent[row] = arrived, sent - arrived
        memory = _COST_MEMORY if self._count else 0.0
        self.cost = memory * self.cost + (1.0 - memory) * (sent - begun)
        self._count += 1

    def pace(self, frames: int = KEPT) -> Pace:
        """Rate and latency of the latest frames."""
        count = min(frames, self._count, KEPT)
        if not count:
            return Pace(*[math.nan] * 4)
        rows = np.arange(self._count - count, self._count) % KEPT
        latencies = 1e3 * np.percentile(self._spent[rows], [50, 99, 100])
        lasted = self._arrived[rows[-1]] - self._arrived[rows[0]]
        return Pace(float((count - 1) / lasted) if lasted > 0 else math.nan, *latencies.tolist())
