"""When the next frame is to be expected, and so when to get ready for it."""

from __future__ import annotations

import math

EARLY = 0.75
"""Share of the time between two frames after which the next may come any moment."""
EVERY = 0.001
"""Seconds after which what was got ready is cold again: other programs use the caches as well."""
SHARE = 0.25
"""Of the time, at most, that is spent on getting ready while a frame may come any moment."""
SILENCE = 0.25
"""Seconds without a frame after which nobody expects one."""
_STEADY = 0.9


class Rhythm:
    """Knows how often frames come."""

    def __init__(self) -> None:
        self._last, self._gap = -math.inf, 0.0

    def heard(self, arrived: float) -> None:
        """Count a frame by the second of its arrival."""
        gap, self._last = arrived - self._last, arrived
        if gap < SILENCE:
            self._gap = _STEADY * self._gap + (1.0 - _STEADY) * gap

    def until_ready(self, now: float, cost: float) -> float:
        """Seconds until it is time to get ready, which takes `cost`; infinite in a silence."""
        if now - self._last >= SILENCE:
            return math.inf
        return max(self._last + EARLY * self._gap - now, EVERY, cost / SHARE)
