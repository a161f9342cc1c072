"""A sender of poses as UDP packets to one address."""

from __future__ import annotations

import ipaddress
import logging
import socket
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from facert.live.frames import Counters, Encoder, Frame

if TYPE_CHECKING:
    from facert.retarget.stream import Streamed

SocketAddress = tuple[Any, ...]
"""As the system gives and takes it: host, port, and more of IPv6."""

log = logging.getLogger("facert")


def written_place(host: str, port: int) -> str:
    """``127.0.0.1:39539``, or ``[::1]:39539``."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


class UdpSender:
    """Sends each pose at once, without ever waiting.

    Parameters
    ----------
    encoder : Encoder
    family : socket.AddressFamily
    address : tuple
        Resolved, as `socket.sendto` takes it.
    counters : Counters
        Where packets are counted that the system would not send, or that nobody took.

    Attributes
    ----------
    address : tuple
    """

    def __init__(
        self,
        encoder: Encoder,
        family: socket.AddressFamily,
        address: SocketAddress,
        counters: Counters,
    ) -> None:
        self.address = address
        self._warned = False
        self._encoder, self._counters = encoder, counters
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._connected = self._connect()

    @property
    def place(self) -> str:
        """Host and port, as they are written."""
        return written_place(*self.address[:2])

    def send(self, frame: Frame, pose: Streamed) -> None:
        """Send the packets of a pose."""
        for packet in self._encoder.encode(pose.params, frame.time):
            try:
                self._pass_on(packet)
            except OSError as error:  # a full buffer, a network that is gone
                if not self._counters.unsent:
                    log.warning("packets to %s are lost: %s", self.place, error.strerror)
                self._counters.unsent += 1

    def rehearse(self, frame: Frame, pose: Streamed) -> None:
        """Encode a pose without sending it, to warm up."""
        self._encoder.encode(pose.params, frame.time)

    def _connect(self) -> bool:
        """Connect to an address of this machine, so that the system reports when nobody listens.

        To another machine, a connected socket would stay with the network that there is now.
        """
        if not ipaddress.ip_address(self.address[0].partition("%")[0]).is_loopback:
            return False
        try:
            self._socket.connect(self.address)
        except OSError:  # reported when there is something to send
            return False
        return True

    def _pass_on(self, packet: bytes) -> None:
        if not self._connected:
            self._socket.sendto(packet, self.address)
            return
        try:
            self._socket.send(packet)
        except ConnectionError:  # of the packet before; this one was not sent
            self._count_refused()
            with suppress(ConnectionError):
                self._socket.send(packet)

    def _count_refused(self) -> None:
        if not self._warned:
            log.warning("nobody listens on %s; poses are sent there all the same", self.place)
            self._warned = True
        self._counters.refused += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
