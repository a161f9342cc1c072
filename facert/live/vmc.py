"""Named numbers over OSC: the Virtual Motion Capture protocol, and plain messages.

==============================  =====================================================
``/VMC/Ext/Blend/Val s f``      one weight
``/VMC/Ext/T f``                the sender's clock, seconds
``/VMC/Ext/Blend/Apply``        the frame is complete
``/facert/NAME f``              one weight; ``fff`` one marker; any other first part will do
``/facert/frame f``             the frame is complete, and the sender's clock
==============================  =====================================================

Some senders send only what changed: what a frame does not bring is as it was. What never came is
not observed.
"""

from __future__ import annotations

import logging
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.take import SourceKind
from facert.live.frames import BadPacketError, Decoder, Observed, frame_pattern
from facert.live.osc import Bundles, Message, PacketTemplates, message, parse
from facert.live.stream_names import StreamNames

log = logging.getLogger("facert")

_VMC = "/VMC/"
_VALUE, _CLOCK, _APPLY = "/VMC/Ext/Blend/Val", "/VMC/Ext/T", "/VMC/Ext/Blend/Apply"
_FRAME = "/frame"
_NOT_IN_ADDRESS = re.compile(r"[\s#*,/?\[\]{}]")
_ROWS = 128
_ENDLESS = 500  # Values without the end of a frame


@dataclass(frozen=True, eq=False)
class _Use:
    """The use of a datagram's numbers, as far as they belong to one frame."""

    cells: IntArray
    numbers: IntArray
    """`cells` are where values belong, `numbers` which of the numbers they are, (k,)."""
    clock: slice | None
    end: slice | None
    """The numbers of the sender's `clock`, and of the message that is the frame's `end`; None where
    there is no such message."""


class OscDecoder(Decoder):
    """A decoder of VMC and plain messages; a frame may be spread over several packets.

    Parameters
    ----------
    names : sequence of str, length D or M
        Wanted weights or markers, found in any spelling; others are passed over.
    kind : {"weights", "markers"}
    units : str
        Unit of markers: the model's, as packets do not name any.
    """

    from_midnight = False

    def __init__(self, names: Sequence[str], kind: SourceKind, units: str = "") -> None:
        self.pattern = frame_pattern(names, kind, units)
        self._numbers = 3 if kind == "markers" else 1
        self._reported = self._ended = self._broken = False
        self._endless = 0
        self.forget()

    def forget(self) -> None:
        """See `facert.live.frames.Decoder`."""
        self._names = StreamNames(self.pattern.source.names)
        # What came last under each name of the stream; the last row, never filled, is for absent
        self._held = np.full((_ROWS, self._numbers), np.nan)
        self._stamp: float | None = None
        self._templates: PacketTemplates[list[_Use]] = PacketTemplates()

    def decode(self, packet: bytes) -> Observed | None:
        """The frame that a packet completes; see `facert.live.frames.Decoder`."""
        found = self._templates.find(packet)
        if found is None:
            messages = parse(packet)
            numbers = np.array([number for one in messages for number in one.numbers], np.float64)
            finite = self._checked(numbers)
            uses = self._uses(messages)
            self._templates.remember(packet, messages, uses)
        else:
            uses, numbers = found
            finite = self._checked(numbers)
        observed = None
        for use in uses:
            observed = self._fill(use, numbers, finite) or observed
        return observed

    def _checked(self, numbers: FloatArray) -> bool:
        """Whether all numbers of a packet are finite; refuse a packet of which none is."""
        finite = np.isfinite(numbers)
        if finite.all():
            return True
        if not finite.any():
            raise BadPacketError("NaN or infinity")
        if not self._broken:
            log.warning("NaN or infinity came for a value: it stays as it was")
        self._broken = True
        return False

    def rehearse(self, packet: bytes) -> None:
        """See `facert.live.frames.Decoder`; nothing is filled in."""
        self._templates.find(packet)

    def _fill(self, use: _Use, numbers: FloatArray, finite: bool) -> Observed | None:
        """The frame that a datagram's numbers complete, if they do."""
        cells, values = use.cells, numbers[use.numbers]
        if not finite:  # a marker counts as a whole
            good = np.isfinite(values.reshape(-1, self._numbers)).all(axis=1)
            kept = np.repeat(good, self._numbers)
            cells, values = cells[kept], values[kept]
        self._held.reshape(-1)[cells] = values
        if use.clock is not None:
            self._stamp = _first(numbers[use.clock])
        if use.end is None:
            self._warn_if_endless(len(use.cells))
            return None
        self._ended = True
        self._names.settle()
        values = self._held[self._names.rows]
        values = values if self._numbers == 3 else values[:, 0]
        stamp = _first(numbers[use.end])
        stamp, self._stamp = self._stamp if stamp is None else stamp, None
        identity = None if stamp is None else struct.pack("d", stamp) + values.tobytes()
        return Observed(values, stamp=stamp, identity=identity, known=self._is_known())

    def _is_known(self) -> bool:
        """Whether a name of the stream is known, or there is none; the first time, log others."""
        if not self._names.count:
            return True
        if not self._reported:
            self._names.report()
            self._reported = True
        return bool((self._names.rows >= 0).any())

    def _warn_if_endless(self, values: int) -> None:
        """Warn once about a sender that never completes a frame."""
        if self._ended:
            return
        self._endless += values
        if self._endless >= _ENDLESS:
            self._ended = True
            log.warning("values come, but nothing completes a frame: send %s or /frame", _APPLY)

    def _uses(self, messages: Sequence[Message]) -> list[_Use]:
        """The use of the messages' numbers, one for each frame that they belong to."""
        uses: list[_Use] = []
        cells: list[int] = []
        numbers: list[int] = []
        clock, count = None, 0
        for position, one in enumerate(messages, 1):
            own = slice(count, count + len(one.numbers))
            count = own.stop
            ends = one.address == _APPLY or one.address.endswith(_FRAME)
            if one.address == _CLOCK:
                clock = own
            elif not ends and (row := self._row(one)) is not None:
                cells += range(row * self._numbers, (row + 1) * self._numbers)
                numbers += range(own.start, own.stop)
            if ends or position == len(messages):
                found = np.array(cells, np.int64), np.array(numbers, np.int64)
                uses.append(_Use(*found, clock, own if ends else None))
                cells, numbers, clock = [], [], None
        return uses

    def _row(self, one: Message) -> int | None:
        """Row at which a message's numbers belong; None if nowhere."""
        if len(one.numbers) != self._numbers:
            return None
        if one.address.startswith(_VMC):
            path, name = "", one.texts[0] if one.address == _VALUE and one.texts else ""
        else:
            path, _, name = one.address.rpartition("/")
        row = self._names.row(name, path) if name else None
        if row is not None and row >= len(self._held) - 1:
            self._held = np.vstack([self._held, np.full_like(self._held, np.nan)])
        return row


def _first(numbers: FloatArray) -> float | None:
    return float(numbers[0]) if len(numbers) and np.isfinite(numbers[0]) else None


class VmcEncoder:
    """An encoder of poses as a VMC performer sends them.

    Parameters
    ----------
    controls : sequence of str, length P
    """

    def __init__(self, controls: Sequence[str]) -> None:
        values = [message(_VALUE, name, 0.0) for name in controls]
        self._bundles = Bundles([message(_CLOCK, 0.0), *values], last=message(_APPLY))

    def encode(self, params: FloatArray, time: float) -> list[bytes]:
        """The clock, every control, and the message that applies them."""
        return self._bundles.filled(np.concatenate([[time], params]))


class OscEncoder:
    """An encoder of poses as plain messages ``/facert/NAME f``, in bundles.

    Parameters
    ----------
    controls : sequence of str, length P
        Characters that an address cannot hold become ``_``.
    """

    def __init__(self, controls: Sequence[str]) -> None:
        addresses = [f"/facert/{_NOT_IN_ADDRESS.sub('_', name)}" for name in controls]
        values = [message(address, 0.0) for address in addresses]
        self._bundles = Bundles([*values, message(f"/facert{_FRAME}", 0.0)])

    def encode(self, params: FloatArray, time: float) -> list[bytes]:
        """Encode every control, and the message that completes the frame."""
        return self._bundles.filled(np.concatenate([params, [time]]))
