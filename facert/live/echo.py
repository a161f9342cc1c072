"""Poses must not come back as frames."""

from __future__ import annotations

import ipaddress
import socket

from facert.errors import InputError
from facert.live.receivers import UdpReceiver
from facert.live.senders import UdpSender


def refuse_echo(receiver: UdpReceiver, sender: UdpSender) -> None:
    """Refuse to send where the session itself listens, whatever the protocols.

    Raises
    ------
    InputError
        When its own poses would drown the performance.
    """
    if sender.address[1] == receiver.port and _reaches(sender.address[0], receiver.host):
        raise InputError(
            f"--out {sender.place}",
            "another port than that of --in",
            "where facert itself listens",
            "Give the port that the other program listens on.",
        )


def _reaches(host: str, listening: str) -> bool:
    """Whether what is sent to a host comes to who listens there, on the same port."""
    to, here = _plain(host), _plain(listening)
    if to == here or to.is_unspecified:
        return True
    return here.is_unspecified and here.version >= to.version and _is_own(to)


def _plain(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    """An address without its network's name; one of version 4 as such."""
    found = ipaddress.ip_address(host.partition("%")[0])
    return getattr(found, "ipv4_mapped", None) or found


def _is_own(host: ipaddress.IPv4Address | ipaddress.IPv6Address) -> bool:
    """Whether this machine has the address: only then can a socket be bound to it."""
    family = socket.AF_INET if host.version == 4 else socket.AF_INET6
    with socket.socket(family, socket.SOCK_DGRAM) as tried:
        try:
            tried.bind((str(host), 0))
        except OSError:
            return False
    return True
