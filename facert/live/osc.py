"""Open Sound Control 1.0: as much of it as carries named numbers, safe for whatever comes in.

A reader for hostile packets must end for every one of them: sizes are checked before they are
followed, and bundles in bundles are counted, not recursed into without end.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.live.frames import BadPacketError

MOST_BYTES = 1400
"""Of one packet that is sent: larger ones are cut into fragments on the way."""
LEAST, MOST = 256, 2**14
"""Bytes of a packet that is kept as a template: shorter ones are parsed as quickly, longer ones
would take much memory."""
MOST_LENGTHS, MOST_ALIKE = 16, 4
"""How many lengths of templates are kept, and how many templates of one length."""

Use = TypeVar("Use")

_BUNDLE = b"#bundle\0"
_AT_ONCE = _BUNDLE + struct.pack(">Q", 1)
_DEEPEST = 4
_INT = struct.Struct(">i")
# Formats of numbers, sizes in bytes of other arguments, and the values of those without any.
_NUMBERS = {tag: struct.Struct(f">{code}") for tag, code in zip("ifhd", "ifqd", strict=True)}
_SKIPPED = {"t": 8, "r": 4, "m": 4, "c": 4}
_EMPTY = {"T": 1.0, "F": 0.0}
_PASSED = "NI[]"


@dataclass(frozen=True, slots=True)
class Message:
    """An address and the texts and numbers that come with it."""

    address: str
    texts: tuple[str, ...]
    numbers: tuple[float, ...]
    place: int = field(default=-1, compare=False)
    """Where its numbers are in the datagram, if all follow each other with 32 bits; else -1."""


def parse(packet: bytes) -> list[Message]:
    """Parse the messages of a datagram in order, those of bundles too.

    Raises
    ------
    BadPacketError
        When any of it is malformed.
    """
    found: list[Message] = []
    try:
        _collect(packet, found, 0, 0)
    except (struct.error, UnicodeDecodeError) as error:
        raise BadPacketError("malformed") from error
    return found


def _collect(packet: bytes, found: list[Message], depth: int, place: int) -> None:
    if not packet.startswith(_BUNDLE):
        found.append(_message(packet, place))
        return
    if depth == _DEEPEST or len(packet) < len(_AT_ONCE):
        raise BadPacketError("bundles too deep, or cut off")
    position = len(_AT_ONCE)
    while position < len(packet):
        (size,) = _INT.unpack_from(packet, position)
        position += _INT.size
        if not 0 < size <= len(packet) - position:
            raise BadPacketError("an element of another size")
        _collect(packet[position : position + size], found, depth + 1, place + position)
        position += size


def _message(packet: bytes, place: int) -> Message:
    address, position = _text(packet, 0)
    if not address.startswith("/"):
        raise BadPacketError("no address")
    tags, position = _text(packet, position) if position < len(packet) else (",", position)
    if not tags.startswith(","):
        raise BadPacketError("no type tags")
    texts: list[str] = []
    numbers: list[float] = []
    for tag in tags[1:]:
        if tag in _NUMBERS:
            numbers.append(float(_NUMBERS[tag].unpack_from(packet, position)[0]))
            position += _NUMBERS[tag].size
        elif tag in "sS":
            text, position = _text(packet, position)
            texts.append(text)
        elif tag in _EMPTY:
            numbers.append(_EMPTY[tag])
        elif tag not in _PASSED:
            position = _after(packet, tag, position)
    only = tags.endswith("f" * len(numbers))  # then they are the last that the message holds
    place += len(packet) - _INT.size * len(numbers)
    whole = position == len(packet)
    return Message(address, tuple(texts), tuple(numbers), place if only and whole else -1)


def _after(packet: bytes, tag: str, position: int) -> int:
    """Offset after an argument that is skipped."""
    if tag == "b":
        (size,) = _INT.unpack_from(packet, position)
        length = _INT.size + size + -size % 4 if size >= 0 else len(packet)
    elif tag in _SKIPPED:
        length = _SKIPPED[tag]
    else:
        raise BadPacketError("an unknown type")
    if length > len(packet) - position:
        raise BadPacketError("cut off")
    return position + length


def _text(packet: bytes, position: int) -> tuple[str, int]:
    """A text that ends with NUL, and the position of what follows it."""
    end = packet.find(b"\0", position)
    if end < 0:
        raise BadPacketError("a text without an end")
    return packet[position:end].decode("utf-8"), end + 4 - end % 4


def message(address: str, *arguments: str | float | int) -> bytes:
    """The bytes of a message; floats are sent with 32 bits."""
    tags, body = ",", b""
    for value in arguments:
        if isinstance(value, str):
            tags, body = tags + "s", body + _padded(value)
        elif isinstance(value, int):
            tags, body = tags + "i", body + struct.pack(">i", value)
        else:
            tags, body = tags + "f", body + struct.pack(">f", value)
    return _padded(address) + _padded(tags) + body


def _padded(text: str) -> bytes:
    """The text with the NULs that end it, a multiple of four bytes."""
    raw = text.encode("utf-8")
    return raw + b"\0" * (4 - len(raw) % 4)


class Bundles:
    """Messages that end with a number each, packed once: only the numbers change from then on.

    A message that is longer than `MOST_BYTES` goes alone.

    Parameters
    ----------
    messages : sequence of bytes, length n
        Each ends with a float.
    last : bytes
        A message that follows all others, if any.
    """

    def __init__(self, messages: Sequence[bytes], last: bytes = b"") -> None:
        elements = [_INT.pack(len(raw)) + raw for raw in messages]
        ending = _INT.pack(len(last)) + last if last else b""
        self._packets: list[tuple[FloatArray, IntArray, slice]] = []
        begin = 0
        for end in _groups([len(element) for element in elements], MOST_BYTES - len(ending)):
            packed = b"".join(elements[begin:end]) + (ending if end == len(elements) else b"")
            words = np.frombuffer(_AT_ONCE + packed, ">f4").copy()
            ends = len(_AT_ONCE) + np.cumsum([len(element) for element in elements[begin:end]])
            self._packets.append((words, ends // 4 - 1, slice(begin, end)))
            begin = end

    def filled(self, numbers: FloatArray) -> list[bytes]:
        """The packets with these numbers (n,) at the end of the messages."""
        packets = []
        for words, places, part in self._packets:
            words[places] = numbers[part]
            packets.append(words.tobytes())
        return packets


def _groups(sizes: Sequence[int], most: int) -> list[int]:
    """Ends of the runs of elements that fit into one packet each."""
    ends, filled = [], len(_AT_ONCE)
    for position, size in enumerate(sizes):
        if position and filled + size > most:
            ends.append(position)
            filled = len(_AT_ONCE)
        filled += size
    return [*ends, len(sizes)]


class PacketTemplate:
    """A datagram with room for other numbers.

    A performer sends the same messages frame after frame: while every other word stays what it
    was, a datagram is read as a whole instead of message by message.

    Parameters
    ----------
    packet : bytes
    messages : sequence of Message
        As parsed from it; all numbers have a place.
    """

    def __init__(self, packet: bytes, messages: Sequence[Message]) -> None:
        places = [one.place // _INT.size + k for one in messages for k in range(len(one.numbers))]
        self._places = np.array(places, dtype=np.int64)
        words = np.frombuffer(packet, np.uint32)
        self._fixed = np.delete(np.arange(len(words)), self._places)
        self._words = words[self._fixed]

    def numbers(self, packet: bytes) -> FloatArray | None:
        """The numbers of another datagram of that length, in order; None if other words differ."""
        words = np.frombuffer(packet, np.uint32)
        if (words.take(self._fixed) != self._words).any():
            return None
        with np.errstate(invalid="ignore"):  # of signalling NaN
            return words.view(">f4").take(self._places).astype(np.float64)


class PacketTemplates(Generic[Use]):
    """Templates of datagrams that came before, up to a limit, each with the use of its numbers."""

    def __init__(self) -> None:
        self._known: dict[int, list[tuple[PacketTemplate, Use]]] = {}

    def find(self, packet: bytes) -> tuple[Use, FloatArray] | None:
        """The use of a datagram's numbers, and the numbers; None where no template fits."""
        for template, use in self._known.get(len(packet), ()):
            numbers = template.numbers(packet)
            if numbers is not None:
                return use, numbers
        return None

    def remember(self, packet: bytes, messages: Sequence[Message], use: Use) -> None:
        """Keep a datagram as a template, if its numbers are whole words and there is room."""
        if not LEAST <= len(packet) <= MOST or len(packet) % _INT.size:
            return
        if any(one.place < 0 or one.place % _INT.size for one in messages):
            return
        alike = self._known.get(len(packet), [])
        if len(alike) < MOST_ALIKE and (alike or len(self._known) < MOST_LENGTHS):
            self._known[len(packet)] = [*alike, (PacketTemplate(packet, messages), use)]
