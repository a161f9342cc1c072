"""The session: frames in, mapped, out, one after the other in one thread."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from facert.errors import FacertError
from facert.live.frames import Frame, Output, Receiver
from facert.live.meter import Meter
from facert.live.recording import SourceRecord
from facert.threads import threads_for

if TYPE_CHECKING:
    from facert.streaming import Streamed

log = logging.getLogger("facert")

PATIENCE = 0.1
"""Seconds that the session waits for a frame before it looks whether it shall stop."""
CATCH_UP = 0.03
"""Seconds that frames which waited may take together; older ones are dropped."""


@dataclass(frozen=True)
class Limits:
    """When a session ends by itself: after so many mapped frames, after so many seconds."""

    frames: float = math.inf
    seconds: float = math.inf

    @classmethod
    def of(cls, frames: int | None, seconds: float | None) -> Limits:
        """Of what may not be given."""
        return cls(frames or math.inf, seconds or math.inf)


class Session:
    """Maps what a receiver brings, and sends the poses before anything is recorded.

    A frame is mapped as soon as it is there. Where several have come meanwhile, as after a
    hiccup of the machine, all are mapped if that is done at once (`CATCH_UP`); else the newest
    frame wins and older ones are dropped.

    Parameters
    ----------
    receiver : Receiver
    mapping : callable
        From a frame to its pose; a `FacertError` means that there is none.
    senders, records : sequence of Output
        Where a pose goes at once, and what keeps it then; latency is that of the senders.
    record : SourceRecord, optional
        Keeps every frame that came in.
    """

    def __init__(
        self,
        receiver: Receiver,
        mapping: Callable[[Frame], Streamed],
        senders: Sequence[Output],
        records: Sequence[Output] = (),
        record: SourceRecord | None = None,
    ) -> None:
        self.counters, self.meter = receiver.counters, Meter()
        self._receiver, self._mapping = receiver, mapping
        self._senders, self._records, self._record = senders, records, record

    def run(
        self,
        limits: Limits,
        stopped: Callable[[], bool] = lambda: False,
        between: Callable[[], None] = lambda: None,
    ) -> None:
        """Go on until the source ends, a limit is reached, or `stopped`.

        Parameters
        ----------
        limits : Limits
        stopped : callable
            Whether somebody wants it to end; asked every `PATIENCE` seconds at least.
        between : callable
            Called when nothing waits, e.g. to show how it goes.
        """
        end = time.perf_counter() + limits.seconds
        with threads_for(1):
            while not (stopped() or self._receiver.finished or self._done(limits)):
                left = end - time.perf_counter()
                if left <= 0:
                    break
                self._turn(self._receiver.wait(min(PATIENCE, left)), limits)
                between()

    def _done(self, limits: Limits) -> bool:
        return self.counters.mapped >= limits.frames

    def _turn(self, frames: Sequence[Frame], limits: Limits) -> None:
        """Map the frames that there is time for, and record all."""
        most = max(1, int(CATCH_UP / self.meter.cost)) if self.meter.cost else len(frames)
        self.counters.dropped += max(0, len(frames) - most)
        for frame in frames[-most:]:
            if self._done(limits):
                break
            self._map(frame)
        if self._record is not None:
            for frame in frames:
                self._record.add(frame)

    def _map(self, frame: Frame) -> None:
        begun = time.perf_counter()
        try:
            pose = self._mapping(frame)
        except FacertError as error:
            if not self.counters.failed:
                log.warning("a frame has no pose, nothing is sent for such: %s", error)
            self.counters.failed += 1
            return
        for sender in self._senders:
            sender.send(frame, pose)
        self.meter.add(frame.arrived, begun, time.perf_counter())
        self.counters.mapped += 1
        for record in self._records:
            record.send(frame, pose)
