"""Packets of Live Link Face over UDP, version 6, both ways.

===========  ========================================================================
``<I``       6: the version, alone in little-endian
37 bytes     ``$`` and the device's UUID
``!i`` name  length of the subject's name, and the name
``!if``      frame number and fraction, counted from midnight at the rate that follows
``!ii``      the rate: numerator, denominator
``!B``       61; missing, or 0, when no face was seen
``!61f``     52 shapes, then nine angles in radians
===========  ========================================================================

In the packet ``jawLeft`` and ``mouthLeft`` stand before their right; in the CSV after.
"""

from __future__ import annotations

import logging
import struct
import time
import uuid
from collections.abc import Sequence

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import ARKIT_NAMES, NameIndex, nearest
from facert.data.timecode import LIVE_LINK_RATE
from facert.errors import InputError
from facert.live.frames import BadPacketError, Decoder, Observed, frame_pattern

log = logging.getLogger("facert")

VERSION = 6
ABSURD = 100.0
"""No weight and no angle comes near it."""

_TURNED = {"jawLeft": "jawRight", "mouthLeft": "mouthRight"}
_TURNED |= {right: left for left, right in _TURNED.items()}
PACKET_NAMES = tuple(_TURNED.get(name, name) for name in ARKIT_NAMES)
"""The 61 names in the order of the packet."""

_VERSION = struct.Struct("<I")
_LENGTH = struct.Struct("!i")
_TIME = struct.Struct("!ifii")
_NAME_AT = 45
_MOST_NAME = 256
_COUNT = len(PACKET_NAMES)
_NO_FACE = np.full(_COUNT, np.nan)


class LiveLinkDecoder(Decoder):
    """A decoder of Live Link Face; one packet is one frame."""

    pattern = frame_pattern(PACKET_NAMES)
    from_midnight = True

    def decode(self, packet: bytes) -> Observed | None:
        """The frame of a packet; see `facert.live.frames.Decoder`."""
        clock = _NAME_AT + _name_length(packet)
        block = clock + _TIME.size
        if len(packet) < block:
            raise BadPacketError("cut off before its time")
        frame, fraction, rate, denominator = _TIME.unpack_from(packet, clock)
        if not (frame >= 0 and 0.0 <= fraction <= 1.0 and rate > 0 and denominator >= 0):
            raise BadPacketError("no such time")
        return Observed(
            _values(packet, block),
            sender=packet[4:clock].decode("latin-1"),
            stamp=(frame + fraction) * max(denominator, 1) / rate,
            identity=packet,
        )


class LiveLinkEncoder:
    """An encoder of poses as the app sends them.

    Parameters
    ----------
    controls : sequence of str, length P
        Matched to ARKit's names in any spelling. A shape that is one in ARKit, and a left and a
        right half in the character, gets their mean; the packet has no place for others.

    Raises
    ------
    InputError
        When no control is one of ARKit's.
    """

    def __init__(self, controls: Sequence[str]) -> None:
        self._places, self._left, self._right = _halves(controls)
        self._values = np.zeros(_COUNT, dtype=">f4")
        name = b"facert"
        device = f"${uuid.uuid4()}".upper().encode()
        self._head = _VERSION.pack(VERSION) + device + _LENGTH.pack(len(name)) + name
        now = time.localtime()
        self._midnight = (now.tm_hour * 60 + now.tm_min) * 60 + now.tm_sec

    def encode(self, params: FloatArray, time: float) -> list[bytes]:
        """One packet; shapes that the character has no control for are 0."""
        self._values[self._places] = 0.5 * (params[self._left] + params[self._right])
        frame, fraction = divmod((self._midnight + time) * LIVE_LINK_RATE, 1.0)
        clock = _TIME.pack(int(frame), fraction, LIVE_LINK_RATE, 1)
        return [self._head + clock + bytes([_COUNT]) + self._values.tobytes()]


def _name_length(packet: bytes) -> int:
    if len(packet) < _NAME_AT or _VERSION.unpack_from(packet)[0] != VERSION or packet[4:5] != b"$":
        raise BadPacketError("not Live Link Face, version 6")
    length: int = _LENGTH.unpack_from(packet, _NAME_AT - _LENGTH.size)[0]
    if not 0 <= length <= _MOST_NAME:
        raise BadPacketError("no such name")
    return length


def _values(packet: bytes, start: int) -> FloatArray:
    """The values of a packet, (61,); NaN where no face was seen."""
    count = packet[start] if len(packet) > start else 0
    if count not in (0, _COUNT) or len(packet) > start + 1 + 4 * count:
        raise BadPacketError("another number of values")
    if not count:
        return _NO_FACE
    if len(packet) < start + 1 + 4 * count:
        raise BadPacketError("cut off")
    with np.errstate(invalid="ignore"):  # of signalling NaN
        values = np.frombuffer(packet, ">f4", count, start + 1).astype(np.float64)
    if not (np.abs(values) <= ABSURD).all():
        raise BadPacketError("values that are no weights")
    return values


def _halves(controls: Sequence[str]) -> IntArray:
    """Which controls' mean goes where in the packet, (3, k): place, left and right control.

    A control without sides is both of its halves.
    """
    index = NameIndex.among(controls, PACKET_NAMES, "--out livelink", halves=True)
    found, halved = [], []
    for place, name in enumerate(PACKET_NAMES):
        columns = index.find_halves(name)
        if columns:
            found.append((place, columns[0], columns[-1]))
        if len(columns) > 1:
            halved.append(name)
    used = {column for _, *columns in found for column in columns}
    _report_foreign([name for column, name in enumerate(controls) if column not in used], controls)
    if halved:
        log.info("Live Link gets the mean of the left and the right %s", ", ".join(halved))
    return np.array(found, dtype=np.int64).T


def _report_foreign(foreign: Sequence[str], controls: Sequence[str]) -> None:
    """Warn about controls that the packet has no place for; refuse when that is all of them."""
    if len(foreign) == len(controls):
        near = nearest(foreign[0], PACKET_NAMES)
        raise InputError(
            "--out livelink",
            "controls with names of ARKit",
            repr(foreign[0]) + (f" (nearest: {near!r})" if near else ""),
            "Send them with vmc or osc, which take any name.",
        )
    if foreign:
        log.warning("Live Link has no place for %s: not sent", ", ".join(foreign))
