"""Where poses go: UDP packets to one address."""

from __future__ import annotations

import logging
import socket
from typing import TYPE_CHECKING, Any

from facert.live.frames import Counters, Encoder, Frame

if TYPE_CHECKING:
    from facert.streaming import Streamed

SocketAddress = tuple[Any, ...]
"""As the system gives and takes it: host, port, and more of IPv6."""

log = logging.getLogger("facert")


class UdpSender:
    """Sends each pose at once and never waits for anybody.

    Parameters
    ----------
    encoder : Encoder
    family : socket.AddressFamily
    address : tuple
        Resolved, as `socket.sendto` takes it.
    counters : Counters
        Where packets are counted that the system would not send.
    """

    def __init__(
        self,
        encoder: Encoder,
        family: socket.AddressFamily,
        address: SocketAddress,
        counters: Counters,
    ) -> None:
        self._encoder, self._address, self._counters = encoder, address, counters
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, frame: Frame, pose: Streamed) -> None:
        """Send the packets of a pose."""
        for packet in self._encoder.encode(pose.params, frame.time):
            try:
                self._socket.sendto(packet, self._address)
            except OSError as error:  # a full buffer, a network that is gone
                if not self._counters.unsent:
                    log.warning("packets to %s:%s are lost: %s", *self._address[:2], error.strerror)
                self._counters.unsent += 1

    def rehearse(self, frame: Frame, pose: Streamed) -> None:
        """Do what `send` does before it sends."""
        self._encoder.encode(pose.params, frame.time)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
