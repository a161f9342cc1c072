"""Packets of iFacialMocap: text, ``name-INT|...|=head#x,y,z,...|``, names in any order.

Weights are whole hundredths; a shape that a packet does not bring is as it was. No face was seen
with ``trackingStatus-0``. The angles come in another convention than Live Link Face's, in degrees,
and are left out.
"""

from __future__ import annotations

import re

import numpy as np

from facert.data.names import ARKIT_SHAPES, NameIndex
from facert.live.frames import BadPacketError, Decoder, Observed, frame_pattern

_FIELD = re.compile(r"([A-Za-z_]{1,40})[-&](-?\d{1,4})")
_LEAST = len(ARKIT_SHAPES) // 2
_STATUS = "trackingStatus"
_INDEX = NameIndex(ARKIT_SHAPES)


class IFacialMocapDecoder(Decoder):
    """A decoder of iFacialMocap, both its versions; one packet is one frame."""

    pattern = frame_pattern(ARKIT_SHAPES)
    from_midnight = False

    def __init__(self) -> None:
        # Spellings are few and fixed, and folding one takes microseconds.
        self._spelled: dict[str, int | None] = {}
        self.forget()

    def forget(self) -> None:
        """See `facert.live.frames.Decoder`."""
        self._held = np.full(len(ARKIT_SHAPES), np.nan)

    def decode(self, packet: bytes) -> Observed | None:
        """The frame of a packet; see `facert.live.frames.Decoder`."""
        try:
            text = packet.decode("ascii")
        except UnicodeDecodeError as error:
            raise BadPacketError("not plain text") from error
        fields = dict(_FIELD.findall(text.partition("=")[0]))
        if fields.get(_STATUS) == "0":
            self.forget()
            return Observed(self._held)
        values = self._held.copy()
        for name, number in fields.items():
            place = self._place(name)
            if place is not None:
                values[place] = int(number) / 100.0
        if not fields or np.isfinite(values).sum() < _LEAST:
            raise BadPacketError("not iFacialMocap")
        self._held = values
        return Observed(values)

    def _place(self, name: str) -> int | None:
        if name not in self._spelled and len(self._spelled) < 16 * len(ARKIT_SHAPES):
            self._spelled[name] = _INDEX.find(name)
        return self._spelled.get(name)
