"""Datagrams of OSC in which only numbers change: read as a whole, not message by message.

A performer sends the same messages frame after frame. What was parsed once need not be parsed
again while every other word of the datagram stays what it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, TypeVar

import numpy as np

from facert.data.arrays import FloatArray
from facert.live.osc import Message

LEAST, MOST = 256, 2**14
"""Bytes: shorter datagrams are parsed as quickly, longer ones would take much memory."""
MOST_LENGTHS, MOST_ALIKE = 16, 4
"""Datagrams that are remembered, of so many lengths, and so many of each: others are parsed."""
_WORD = 4


Use = TypeVar("Use")


class PacketTemplate:
    """One datagram whose numbers may be anything.

    Parameters
    ----------
    packet : bytes
    messages : sequence of Message
        What was parsed of it; all numbers have a place.
    """

    def __init__(self, packet: bytes, messages: Sequence[Message]) -> None:
        places = [one.place // _WORD + k for one in messages for k in range(len(one.numbers))]
        self._places = np.array(places, dtype=np.int64)
        words = np.frombuffer(packet, np.uint32)
        self._fixed = np.delete(np.arange(len(words)), self._places)
        self._words = words[self._fixed]

    def numbers(self, packet: bytes) -> FloatArray | None:
        """All numbers of another datagram of that length, in order; None if it is not alike."""
        words = np.frombuffer(packet, np.uint32)
        if (words.take(self._fixed) != self._words).any():
            return None
        with np.errstate(invalid="ignore"):  # of signalling NaN
            return words.view(">f4").take(self._places).astype(np.float64)


class PacketTemplates(Generic[Use]):
    """The datagrams that came before, up to a limit, each with what its numbers are used for."""

    def __init__(self) -> None:
        self._known: dict[int, list[tuple[PacketTemplate, Use]]] = {}

    def find(self, packet: bytes) -> tuple[Use, FloatArray] | None:
        """Of one that is like this: its use, and the numbers of this."""
        for layout, use in self._known.get(len(packet), ()):
            numbers = layout.numbers(packet)
            if numbers is not None:
                return use, numbers
        return None

    def remember(self, packet: bytes, messages: Sequence[Message], use: Use) -> None:
        """Keep one more, if it can be read as a whole and there is room."""
        if not LEAST <= len(packet) <= MOST or len(packet) % _WORD:
            return
        if any(one.place < 0 or one.place % _WORD for one in messages):
            return
        alike = self._known.get(len(packet), [])
        if len(alike) < MOST_ALIKE and (alike or len(self._known) < MOST_LENGTHS):
            self._known[len(packet)] = [*alike, (PacketTemplate(packet, messages), use)]
