"""One sender's frames in order: no copies, nothing out of turn, and a clock that always rises."""

from __future__ import annotations

import math
from collections import OrderedDict

from facert.live.frames import Observed

SILENCE = 0.25
"""Seconds without a frame after which the next sender, whoever it is, begins anew."""
REMEMBERED = 2**14
"""Frames whose copies are known: two minutes at 120 frames/s."""
_LEAST_STEP = 1e-4
# A clock that often steps back, or stands still, is not used: some senders have such.
_STEP_BACK, _STAND_STILL, _STEP_ON, _DISTRUST = 3, 1, -1, 30


class Order:
    """Admits or refuses frame after frame, and places it in time.

    While a sender is active, frames of others, copies of its own and those from before its latest
    are refused. After `SILENCE` any frame is accepted: another sender, a clock that was set, a
    recording that begins again.
    """

    def __init__(self) -> None:
        self._time = 0.0
        self._arrived = -math.inf
        self._host = self._sender = ""
        self._stamp: float | None = None
        self._ahead = 0.0
        self._disorder = 0
        self._known: OrderedDict[int, None] = OrderedDict()

    def admits(self, host: str, arrived: float) -> bool:
        """Whether packets of this host are accepted now."""
        return host == self._host or not self._active(arrived)

    def place(self, observed: Observed, host: str, arrived: float) -> float | None:
        """The frame's time in the session, strictly rising from 0; None when it is refused."""
        if (host, observed.sender) != (self._host, self._sender):
            if self._active(arrived):
                return None
            self._begin_anew(host, observed.sender)
        elif not (self._active(arrived) or self._resumes(observed.stamp, arrived)):
            self._begin_anew(host, observed.sender)
        if self._is_copy(observed.identity) or self._is_late(observed.stamp):
            return None
        self._remember(observed.identity)
        self._time = self._moment(observed.stamp, arrived)
        self._stamp, self._arrived = observed.stamp, arrived
        return self._time

    def _active(self, arrived: float) -> bool:
        return arrived - self._arrived < SILENCE

    def _resumes(self, stamp: float | None, arrived: float) -> bool:
        """Whether the sender's clock ran on during a silence: the network or facert paused."""
        if stamp is None or self._stamp is None:
            return False
        return self._stamp < stamp and self._goes_on(stamp, arrived - self._arrived)

    def _begin_anew(self, host: str, sender: str) -> None:
        self._host, self._sender = host, sender
        self._stamp, self._disorder = None, 0
        self._known.clear()

    def _is_copy(self, identity: bytes | None) -> bool:
        return identity is not None and hash(identity) in self._known

    def _is_late(self, stamp: float | None) -> bool:
        """Whether a newer frame, by the sender's clock, arrived before."""
        if stamp is None or self._stamp is None or self._disorder >= _DISTRUST:
            return False
        step = stamp - self._stamp
        found = _STEP_BACK if step < 0 else _STEP_ON if step > 0 else _STAND_STILL
        self._disorder = max(0, self._disorder + found)
        return step < 0

    def _remember(self, identity: bytes | None) -> None:
        if identity is None:
            return
        self._known[hash(identity)] = None
        if len(self._known) > REMEMBERED:
            self._known.popitem(last=False)

    def _moment(self, stamp: float | None, arrived: float) -> float:
        """Time in the session, by the sender's clock while that keeps pace with real time."""
        if self._arrived == -math.inf:
            return self._set_clock(0.0, stamp)
        elapsed = max(arrived - self._arrived, _LEAST_STEP)
        if stamp is None or not self._goes_on(stamp, elapsed):
            return self._set_clock(self._time + elapsed, stamp)
        return max(stamp - self._ahead, self._time + _LEAST_STEP)

    def _goes_on(self, stamp: float, elapsed: float) -> bool:
        """Whether the sender's clock keeps pace with real time: reliable, and not reset."""
        if self._stamp is None or self._disorder >= _DISTRUST:
            return False
        return stamp - self._stamp < elapsed + SILENCE

    def _set_clock(self, moment: float, stamp: float | None) -> float:
        """Tie a sender's stamp to a moment of the session."""
        self._ahead = 0.0 if stamp is None else stamp - moment
        return moment
