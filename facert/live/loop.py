"""A live session: frames in, mapped, out, one after the other in one thread."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from facert.errors import FacertError
from facert.live.frames import Frame
from facert.live.live_model import LiveModel
from facert.live.receivers import Receiver
from facert.live.recording import PoseRecord, SourceRecord
from facert.live.senders import UdpSender
from facert.live.timing import Meter, Rhythm
from facert.models.threads import threads_for

log = logging.getLogger("facert")

PATIENCE = 0.1
"""Seconds that the session waits for a frame before it checks whether to stop."""
CATCH_UP = 0.03
"""Seconds that frames which waited may take together; older ones are dropped."""


@dataclass(frozen=True)
class Limits:
    """Numbers of mapped frames and of seconds after which a session ends by itself."""

    frames: float = math.inf
    seconds: float = math.inf

    @classmethod
    def of(cls, frames: int | None, seconds: float | None) -> Limits:
        """Limits from options, of which None sets none."""
        return cls(frames or math.inf, seconds or math.inf)


class LiveSession:
    """Maps what a receiver brings, and sends the poses before anything is recorded.

    A frame is mapped as soon as it is there. Where several have come meanwhile, as after a
    hiccup of the machine, all are mapped if that is done at once (`CATCH_UP`); else the newest
    frame wins and older ones are dropped.

    A process that sleeps between frames wakes with cold caches, and would take three times as long
    as back to back. So shortly before a frame is due, the last one is rehearsed.

    Parameters
    ----------
    receiver : Receiver
    mapper : LiveModel
    senders, records : sequences of UdpSender and PoseRecord
        Where a pose goes at once, and what keeps it then; latency is that of the senders.
    record : SourceRecord, optional
        Keeps every frame that came in.
    """

    def __init__(
        self,
        receiver: Receiver,
        mapper: LiveModel,
        senders: Sequence[UdpSender],
        records: Sequence[PoseRecord] = (),
        record: SourceRecord | None = None,
    ) -> None:
        self.counters, self.meter = receiver.counters, Meter()
        self._receiver, self._mapper = receiver, mapper
        self._senders, self._records, self._record = senders, records, record
        self._rhythm = Rhythm()
        self._last: Frame | None = None

    def run(
        self,
        limits: Limits,
        stopped: Callable[[], bool] = lambda: False,
        between: Callable[[], None] = lambda: None,
    ) -> None:
        """Run until the source ends, a limit is reached, or `stopped` is set.

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
                now = time.perf_counter()
                if now >= end:
                    break
                ready = self._rhythm.until_ready(now, self.meter.cost)
                frames = self._receiver.wait(min(PATIENCE, end - now, ready))
                if frames:
                    self._turn(frames, limits)
                elif time.perf_counter() >= now + ready:  # else it was a packet without a frame
                    self._rehearse()
                between()

    def _done(self, limits: Limits) -> bool:
        return self.counters.mapped >= limits.frames

    def _turn(self, frames: Sequence[Frame], limits: Limits) -> None:
        """Map the newest frames, as many as there is time for, and record all."""
        most = max(1, int(CATCH_UP / self.meter.cost)) if self.meter.cost else len(frames)
        self.counters.dropped += max(0, len(frames) - most)
        for frame in frames[-most:]:
            if self._done(limits):
                break
            self._map(frame)
        self._mapper.prepare()
        for frame in frames:
            self._rhythm.add(frame.arrived)
            if self._record is not None:
                self._record.add(frame)

    def _map(self, frame: Frame) -> None:
        begun = time.perf_counter()
        try:
            pose = self._mapper.step(frame)
        except FacertError as error:
            if not self.counters.failed:
                log.warning("a frame has no pose, nothing is sent for such: %s", error)
            self.counters.failed += 1
            return
        for sender in self._senders:
            sender.send(frame, pose)
        self.meter.add(frame.arrived, begun, time.perf_counter())
        self._last = frame
        self.counters.mapped += 1
        for record in self._records:
            record.send(frame, pose)

    def _rehearse(self) -> None:
        """Process the last frame again, so that code and data are cached for the next one."""
        if self._last is None:
            return
        self._receiver.rehearse()
        with suppress(FacertError):
            pose = self._mapper.rehearse(self._last)
            for sender in self._senders:
                sender.rehearse(self._last, pose)
