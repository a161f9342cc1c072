"""Frames and counters of a live session, and what a protocol's decoder and encoder do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import Source, SourceKind, Take


class BadPacketError(ValueError):
    """A datagram is malformed; it is counted and passed over."""


@dataclass(frozen=True, slots=True)
class Observed:
    """One observation of one sender."""

    values: FloatArray
    """Weights or markers in the order of the decoder's pattern; NaN: not observed. All NaN when the
    sender saw no face. Shape (D,) or (M, 3)."""
    sender: str = ""
    """Whose frame it is, where the packet names it."""
    stamp: float | None = None
    """Seconds on the sender's clock."""
    identity: bytes | None = None
    """The same for two frames only when one is a copy of the other."""
    known: bool = True
    """Whether any of the names that it brought is known; else all values are NaN."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame of the session."""

    time: float
    """Seconds since the session's first frame, strictly rising."""
    values: FloatArray
    """Weights or markers, (D,) or (M, 3)."""
    arrived: float
    """When it came in, by `time.perf_counter`."""


def frame_pattern(names: Sequence[str], kind: SourceKind = "weights", units: str = "") -> Take:
    """One frame of zeros with these names."""
    shape = (1, len(names), 3) if kind == "markers" else (1, len(names))
    return Take(np.zeros(1), Source(np.zeros(shape), tuple(names)), units=units)


@dataclass
class Counters:
    """Counts of frames and packets by what became of them."""

    received: int = 0
    """Frames with a face, in order: each is mapped, dropped, or failed."""
    mapped: int = 0
    """Frames whose pose was sent."""
    dropped: int = 0
    """Frames that a newer one overtook before they were mapped."""
    failed: int = 0
    """Frames for which there is no finite pose."""
    hidden: int = 0
    """Frames in which the sender saw no face."""
    unknown: int = 0
    """Frames that brought values, but none under a name that is known."""
    late: int = 0
    """Packets that came twice, after a newer one, or from a second sender."""
    bad: int = 0
    """Packets that could not be decoded."""
    unsent: int = 0
    """Packets that the system would not send."""
    refused: int = 0
    """Packets to this machine for which nobody listened, as far as the system reports it."""


class Decoder(Protocol):
    """A decoder of the packets of one protocol."""

    pattern: Take
    """One frame of zeros: names, kind and units of what it returns."""
    from_midnight: bool
    """Whether its stamps count from midnight, as a timecode does."""

    def decode(self, packet: bytes) -> Observed | None:
        """The frame that a packet completes; None while it is not complete.

        Raises
        ------
        BadPacketError
            When the packet is malformed; nothing else has changed then.
        """
        ...

    def rehearse(self, packet: bytes) -> None:
        """Decode a packet again, without effect, so that code and data are cached."""
        self.decode(packet)

    def forget(self) -> None:
        """Forget what came so far: the sender was silent, or another one speaks."""
        return


class Encoder(Protocol):
    """An encoder of poses as the packets of one protocol."""

    def encode(self, params: FloatArray, time: float) -> list[bytes]:
        """The packets of a pose (P,) at a time in seconds."""
        ...
