"""Named numbers over OSC: the Virtual Motion Capture protocol, and plain messages.

==============================  =====================================================
``/VMC/Ext/Blend/Val s f``      one weight
``/VMC/Ext/T f``                the sender's clock, seconds
``/VMC/Ext/Blend/Apply``        the frame is complete
``/facert/NAME f``              one weight; ``fff`` one marker; any other first part will do
``/facert/frame f``             the frame is complete, and the sender's clock
==============================  =====================================================

What a frame does not bring counts as not observed.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import NameIndex
from facert.data.take import SourceKind
from facert.live.frames import BadPacketError, Observed, frame_pattern
from facert.live.osc import Bundles, Message, message, parse
from facert.live.osc_layout import PacketTemplates

_VMC = "/VMC/"
_VALUE, _CLOCK, _APPLY = "/VMC/Ext/Blend/Val", "/VMC/Ext/T", "/VMC/Ext/Blend/Apply"
_FRAME = "/frame"
_NOT_IN_ADDRESS = re.compile(r"[\s#*,/?\[\]{}]")
_MOST_SPELLINGS = 4096


@dataclass(frozen=True, eq=False)
class _Use:
    """What the numbers of a datagram are for.

    Parameters
    ----------
    columns, numbers : arrays of int, shape (k,)
        Where values belong, and which of the numbers they are.
    clock : int, or None
        Which of the numbers is the sender's clock.
    last : Message, or None
        What completes the frame.
    stamp : int, or None
        Which of the numbers comes with that.
    """

    columns: IntArray
    numbers: IntArray
    clock: int | None
    last: Message | None
    stamp: int | None


class OscDecoder:
    """Understands VMC and plain messages; a frame may be spread over several packets.

    Parameters
    ----------
    names : sequence of str, length D or M
        Of the weights or markers that are wanted, found in any spelling; others are passed over.
    kind : {"weights", "markers"}
    units : str
        Of markers: those of the model, as packets do not tell.
    """

    from_midnight = False

    def __init__(self, names: Sequence[str], kind: SourceKind, units: str = "") -> None:
        self.pattern = frame_pattern(names, kind, units)
        self._numbers = 3 if kind == "markers" else 1
        self._index = NameIndex(names)
        self._places: dict[str, int | None] = {}
        self._empty = np.full((len(names), self._numbers), np.nan)
        self._values = self._empty.copy()
        self._stamp: float | None = None
        self._templates: PacketTemplates[_Use] = PacketTemplates()

    def decode(self, packet: bytes) -> Observed | None:
        """What the packet tells; see `facert.live.frames.Decoder`."""
        found = self._templates.find(packet)
        if found is not None:
            return self._filled(*found)
        messages = parse(packet)
        if not all(math.isfinite(number) for one in messages for number in one.numbers):
            raise BadPacketError("NaN or infinity")
        observed = None
        for one in messages:
            if one.address == _APPLY or one.address.endswith(_FRAME):
                observed = self._complete(one)
            elif one.address == _CLOCK:
                self._stamp = one.numbers[0] if one.numbers else None
            else:
                self._note(one)
        use = self._use(messages)
        if use is not None:
            self._templates.remember(packet, messages, use)
        return observed

    def rehearse(self, packet: bytes) -> None:
        """See `facert.live.frames.Decoder`."""
        self._templates.find(packet)

    def _filled(self, use: _Use, numbers: FloatArray) -> Observed | None:
        """What a datagram tells that is like one before, by its numbers."""
        if not np.isfinite(numbers).all():
            raise BadPacketError("NaN or infinity")
        self._values.reshape(-1)[use.columns] = numbers[use.numbers]
        if use.clock is not None:
            self._stamp = float(numbers[use.clock])
        if use.last is None:
            return None
        stamp = () if use.stamp is None else (float(numbers[use.stamp]),)
        return self._complete(replace(use.last, numbers=stamp))

    def _use(self, messages: Sequence[Message]) -> _Use | None:
        """What the numbers of messages are for; None where that is not always the same."""
        columns, numbers = [], []
        clock = last = stamp = None
        count = 0
        for one in messages:
            if last is not None or (one.address == _CLOCK and not one.numbers):
                return None
            if one.address == _APPLY or one.address.endswith(_FRAME):
                last, stamp = one, count if one.numbers else None
            elif one.address == _CLOCK:
                clock = count
            else:
                place = self._wanted(one)
                if place is not None:
                    columns += [place * self._numbers + k for k in range(self._numbers)]
                    numbers += [count + k for k in range(self._numbers)]
            count += len(one.numbers)
        return _Use(np.array(columns, np.int64), np.array(numbers, np.int64), clock, last, stamp)

    def _note(self, one: Message) -> None:
        """Keep what a message says of a name that is wanted."""
        place = self._wanted(one)
        if place is not None:
            self._values[place] = one.numbers

    def _wanted(self, one: Message) -> int | None:
        """Where its numbers belong, if they do."""
        if len(one.numbers) != self._numbers:
            return None
        if one.address.startswith(_VMC):
            return self._place(one.texts[0] if one.address == _VALUE and one.texts else "")
        return self._place(one.address.rpartition("/")[2])

    def _place(self, name: str) -> int | None:
        if name in self._places:
            return self._places[name]
        place = self._index.find(name)
        if len(self._places) < _MOST_SPELLINGS:
            self._places[name] = place
        return place

    def _complete(self, one: Message) -> Observed:
        """The frame, and a clean slate for the next one."""
        stamp = one.numbers[0] if one.numbers else self._stamp
        values = self._values if self._numbers == 3 else self._values[:, 0]
        identity = None if stamp is None else struct.pack("d", stamp) + values.tobytes()
        self._values, self._stamp = self._empty.copy(), None
        return Observed(values, stamp=stamp, identity=identity)


class VmcEncoder:
    """Writes a pose as a VMC performer does.

    Parameters
    ----------
    controls : sequence of str, length P
    """

    def __init__(self, controls: Sequence[str]) -> None:
        values = [message(_VALUE, name, 0.0) for name in controls]
        self._bundles = Bundles([message(_CLOCK, 0.0), *values], last=message(_APPLY))

    def encode(self, params: FloatArray, time: float) -> list[bytes]:
        """The clock, every control, and the word to apply them."""
        return self._bundles.filled(np.concatenate([[time], params]))


class OscEncoder:
    """Writes a pose as plain messages ``/facert/NAME f``, in bundles.

    Parameters
    ----------
    controls : sequence of str, length P
        Signs that an address cannot hold become ``_``.
    """

    def __init__(self, controls: Sequence[str]) -> None:
        addresses = [f"/facert/{_NOT_IN_ADDRESS.sub('_', name)}" for name in controls]
        values = [message(address, 0.0) for address in addresses]
        self._bundles = Bundles([*values, message(f"/facert{_FRAME}", 0.0)])

    def encode(self, params: FloatArray, time: float) -> list[bytes]:
        """Every control, and the word that the frame is complete."""
        return self._bundles.filled(np.concatenate([params, [time]]))
