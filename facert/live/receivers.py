"""Receivers of frames: from a UDP socket, or from a take that is played in real time."""

from __future__ import annotations

import logging
import math
import select
import socket
import time
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import Take
from facert.data.timecode import TICKS, format_timecode
from facert.live.frames import BadPacketError, Counters, Decoder, Frame, Observed, frame_pattern
from facert.live.order import Order

BUFFER = 2**22
"""Bytes that the system is asked to keep while frames are mapped."""
AT_ONCE = 256
AT_MOST = 0.005
"""Packets, and seconds, before frames are mapped: a flood must not prevent that."""
FORGOTTEN = 0.5
"""Seconds of silence after which values that are not sent again are not observed any longer."""
LOGGED = 5
"""Bad packets that are logged: a flood must not fill the terminal."""
_LARGEST = 2**16

log = logging.getLogger("facert")


class UdpReceiver:
    """A receiver of frames from a socket.

    Parameters
    ----------
    listening : socket
        Bound; it is closed with this.
    decoder : Decoder

    Attributes
    ----------
    pattern : Take
        One frame of zeros: names, kind and units of the frames.
    counters : Counters
    fps : float, optional
        Nominal frames a second, where it is known before.
    finished : bool
        Whether no more frames can come.
    start_timecode : str
        Timecode of the first frame, as in Live Link Face's CSV; empty when unknown.
    """

    fps: float | None = None
    finished = False

    def __init__(self, listening: socket.socket, decoder: Decoder) -> None:
        self.pattern, self.counters = decoder.pattern, Counters()
        self.start_timecode = ""
        self._socket, self._decoder, self._order = listening, decoder, Order()
        self._latest = b""
        self._host, self._silent = "", 0.0
        self._socket.setblocking(False)
        with suppress(OSError):
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)

    @property
    def host(self) -> str:
        """The address of this machine that it listens on."""
        return str(self._socket.getsockname()[0])

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._socket.getsockname()[1])

    def wait(self, seconds: float) -> list[Frame]:
        """The frames that have come, oldest first; after so many seconds also none."""
        frames: list[Frame] = []
        begun = time.perf_counter()
        if not select.select([self._socket], [], [], seconds)[0]:
            self._silent += time.perf_counter() - begun
            return frames
        end = time.perf_counter() + AT_MOST
        for packet, host, arrived in self._waiting():
            frame = self._frame(packet, host, arrived)
            if frame is not None:
                frames.append(frame)
            if arrived > end:
                break
        return frames

    def rehearse(self) -> None:
        """Decode the last packet again to warm up, without effect on the session."""
        if self._latest:
            self._decoder.rehearse(self._latest)

    def _waiting(self) -> Iterator[tuple[bytes, str, float]]:
        """Packets that are there, with their senders' hosts and when they were fetched."""
        for _ in range(AT_ONCE):
            try:
                packet, address = self._socket.recvfrom(_LARGEST)
            except BlockingIOError:
                return
            except OSError:  # Windows reports here packets that nobody took
                continue
            yield packet, str(address[0]), time.perf_counter()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _frame(self, packet: bytes, host: str, arrived: float) -> Frame | None:
        """The frame that a packet completes, if it does and comes in turn."""
        if not self._order.admits(host, arrived):
            self.counters.late += 1
            return None
        self._forget_after_silence(host)
        try:
            observed = self._decoder.decode(packet)
        except BadPacketError as error:
            self._count_bad(packet, host, error)
            return None
        self._latest = packet
        if observed is None:
            return None
        placed = self._order.place(observed, host, arrived)
        if placed is None:
            self.counters.late += 1
            return None
        return self._seen(observed, placed, arrived)

    def _forget_after_silence(self, host: str) -> None:
        """Nothing that came before a silence, or from another sender, is held any longer.

        A pause of this process is no silence: packets wait meanwhile.
        """
        if host != self._host or self._silent >= FORGOTTEN:
            self._decoder.forget()
        self._host, self._silent = host, 0.0

    def _count_bad(self, packet: bytes, host: str, error: BadPacketError) -> None:
        """Count a bad packet, and log it unless there were many."""
        self.counters.bad += 1
        if self.counters.bad <= LOGGED:
            log.debug("bad packet of %d bytes from %s: %s", len(packet), host, error)
        if self.counters.bad == LOGGED:
            log.debug("further bad packets are only counted")

    def _seen(self, observed: Observed, placed: float, arrived: float) -> Frame | None:
        """The frame, unless nothing was seen in it."""
        first = not self.counters.received
        if not observed.known:
            self.counters.unknown += 1
            return None
        if not _count_seen(observed.values, self.counters):
            return None
        if first and self._decoder.from_midnight and observed.stamp is not None:
            self.start_timecode = format_timecode(round(observed.stamp * TICKS))
        return Frame(placed, observed.values, arrived)


class TakeReceiver:
    """A receiver that plays a take at the times of its frames, like `UdpReceiver`.

    Parameters
    ----------
    take : Take
    speed : float
        2 plays it twice as fast.
    """

    def __init__(self, take: Take, speed: float = 1.0) -> None:
        self.pattern = frame_pattern(take.source.names, take.source.kind, take.units)
        self.counters = Counters()
        self.fps: float | None = take.fps
        self.start_timecode = take.start_timecode
        self._time = take.time - take.time[0]
        self._due = self._time / speed
        self._values, self._next = take.source.values, 0
        self._began = math.nan

    @property
    def finished(self) -> bool:
        """Whether playback reached the last frame."""
        return self._next == len(self._time)

    def wait(self, seconds: float) -> list[Frame]:
        """The frames that are due; after so many seconds also none."""
        if self.finished:
            return []
        if math.isnan(self._began):
            self._began = time.perf_counter()
        time.sleep(
            min(seconds, max(0.0, self._began + self._due[self._next] - time.perf_counter()))
        )
        now = time.perf_counter()
        last = int(np.searchsorted(self._due, now - self._began, side="right"))
        first, self._next = self._next, max(last, self._next)
        return [
            Frame(float(self._time[row]), self._values[row], now)
            for row in range(first, self._next)
            if _count_seen(self._values[row], self.counters)
        ]

    def rehearse(self) -> None:
        """Do nothing: a take needs no decoding."""

    def close(self) -> None:
        """Do nothing: no socket is open."""


Receiver = UdpReceiver | TakeReceiver


def _count_seen(values: FloatArray, counters: Counters) -> bool:
    """Count a frame; return whether anything was observed in it."""
    seen = not np.isnan(values).all()
    if seen:
        counters.received += 1
    else:
        counters.hidden += 1
    return seen
