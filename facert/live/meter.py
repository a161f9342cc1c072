"""How fast a session runs: its rate, and how long a frame takes inside of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

KEPT = 2**16
"""Frames that the figures of a whole session go back to: nine minutes at 120 frames/s."""
RECENT = 512
"""Frames that the status line looks at."""
_STEADY = 0.95


@dataclass(frozen=True)
class Pace:
    """Rate and latency of some frames.

    Attributes
    ----------
    rate : float
        Frames a second; NaN before there are two.
    median, p99, worst : float
        Milliseconds from a packet's arrival in the process until its pose is sent; NaN before
        there is one.
    """

    rate: float
    median: float
    p99: float
    worst: float


class Meter:
    """Keeps arrival and latency of the latest frames, in memory that does not grow."""

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
        weight = _STEADY if self._count else 0.0
        self.cost = weight * self.cost + (1.0 - weight) * (sent - begun)
        self._count += 1

    def pace(self, frames: int = KEPT) -> Pace:
        """Of the latest frames."""
        count = min(frames, self._count, KEPT)
        if not count:
            return Pace(*[float("nan")] * 4)
        rows = np.arange(self._count - count, self._count) % KEPT
        median, p99, worst = 1e3 * np.percentile(self._spent[rows], [50, 99, 100])
        lasted = self._arrived[rows[-1]] - self._arrived[rows[0]]
        rate = (count - 1) / lasted if lasted > 0 else float("nan")
        return Pace(float(rate), float(median), float(p99), float(worst))
