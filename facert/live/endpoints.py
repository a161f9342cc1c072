"""Ends of a session as options name them: ``livelink:11111``, ``vmc:HOST:39539``, ``csv:FILE``."""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from facert.data.take import Take
from facert.errors import InputError
from facert.io.registry import OWN_ENDINGS
from facert.live.frames import Counters, Decoder, Encoder
from facert.live.ifacialmocap import IFacialMocapDecoder
from facert.live.livelink_packets import LiveLinkDecoder, LiveLinkEncoder
from facert.live.receivers import UdpReceiver
from facert.live.senders import SocketAddress, UdpSender, written_place
from facert.live.vmc import OscDecoder, OscEncoder, VmcEncoder

LOOPBACK = "127.0.0.1"
IN_FILES: Mapping[str, tuple[str, ...]] = {"take": ()}
OUT_FILES: Mapping[str, tuple[str, ...]] = {"csv": (".csv",), "h5": OWN_ENDINGS}


@dataclass(frozen=True)
class NetworkProtocol:
    """A protocol over UDP: its usual ports, and what reads and writes its packets, where it can."""

    in_port: int
    decoder: Callable[[Take], Decoder]
    out_port: int | None = None
    encoder: Callable[[Sequence[str]], Encoder] | None = None


@dataclass(frozen=True)
class Address:
    """A protocol with a place on the network; without a host, this machine."""

    kind: str
    host: str
    port: int

    @property
    def place(self) -> str:
        """Host and port, as they are written."""
        return written_place(self.host, self.port)


@dataclass(frozen=True)
class File:
    """A file that is played or recorded."""

    kind: str
    path: Path


def parse_input(text: str) -> Address | File:
    """The place that ``KIND[:PORT]`` or ``take:FILE`` names; ValueError for anything else."""
    ports = {kind: protocol.in_port for kind, protocol in PROTOCOLS.items()}
    place = _parse(text, ports, IN_FILES, "livelink:11111")
    if isinstance(place, Address) and place.host != LOOPBACK:
        raise ValueError(f"{text!r}: give {place.kind}:PORT, and the address with --listen")
    return place


def parse_output(text: str) -> Address | File:
    """The place that ``KIND[:HOST][:PORT]``, ``csv:FILE`` or ``h5:FILE`` names, or ValueError."""
    ports = {kind: one.out_port for kind, one in PROTOCOLS.items() if one.out_port is not None}
    return _parse(text, ports, OUT_FILES, f"vmc:{LOOPBACK}:39539")


def _parse(
    text: str, ports: Mapping[str, int], files: Mapping[str, tuple[str, ...]], example: str
) -> Address | File:
    kind, _, rest = text.partition(":")
    if kind in files:
        if not rest or (files[kind] and Path(rest).suffix.lower() not in files[kind]):
            raise ValueError(f"{text!r}: expected {kind}:FILE{' or '.join(files[kind])}")
        return File(kind, Path(rest))
    if kind not in ports:
        known = ", ".join([*ports, *files])
        raise ValueError(f"{text!r}: expected one of {known}, as in {example}")
    host, _, port = rest.rpartition(":") if _ends_in_port(rest) else (rest, "", "")
    number = int(port) if port else ports[kind]
    if not 0 <= number < 2**16:
        raise ValueError(f"{text!r}: there is no port {number}")
    return Address(kind, host.strip("[]") or LOOPBACK, number)


def _ends_in_port(rest: str) -> bool:
    """Whether a port follows the last colon; after that of ``[::1]`` there is none."""
    return rest.rpartition(":")[2].isdecimal() and not rest.endswith("]")


def open_receiver(address: Address, listen: str, wanted: Take) -> UdpReceiver:
    """A receiver of frames from the network.

    Parameters
    ----------
    address : Address
    listen : str
        The machine's own address to bind to: `LOOPBACK` for this machine alone.
    wanted : Take
        With the names, kind and units that the model wants.

    Raises
    ------
    InputError
        When the port is taken, or the protocol cannot bring what the model wants.
    """
    decoder = PROTOCOLS[address.kind].decoder(wanted)
    brought = decoder.pattern.source.kind
    if brought != wanted.source.kind:
        raise InputError(
            f"--in {address.kind}",
            f"{wanted.source.kind}, as the model was trained on",
            brought,
            "Give --in osc or --in take, or a model of tracked weights.",
        )
    family, where = _resolve(address, listen)
    listening = socket.socket(family, socket.SOCK_DGRAM)
    try:
        listening.bind(where)
    except OSError as error:
        listening.close()
        raise InputError(
            f"{address.kind} on {listen}, port {address.port}",
            "an address of this machine and a free port",
            error.strerror or str(error),
            "Close the program that listens there, or choose another port.",
        ) from error
    return UdpReceiver(listening, decoder)


def open_sender(address: Address, controls: tuple[str, ...], counters: Counters) -> UdpSender:
    """A sender of poses to the network.

    Raises
    ------
    InputError
        When there is no such host, or the protocol cannot hold any of the controls.
    """
    make = PROTOCOLS[address.kind].encoder
    assert make is not None  # `parse_output` accepts no others
    encoder = make(controls)
    family, where = _resolve(address, address.host)
    return UdpSender(encoder, family, where, counters)


def refuse_echo(receiver: UdpReceiver, sender: UdpSender) -> None:
    """Check that poses do not go where the session itself listens, whatever the protocols.

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
    """Whether packets to a host reach a listener, both on the same port."""
    to, here = _plain(host), _plain(listening)
    if to == here or to.is_unspecified:
        return True
    return here.is_unspecified and here.version >= to.version and _is_own(to)


def _plain(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    """The address without its scope; a mapped one of version 4 as such."""
    found = ipaddress.ip_address(host.partition("%")[0])
    return getattr(found, "ipv4_mapped", None) or found


def _is_own(host: ipaddress.IPv4Address | ipaddress.IPv6Address) -> bool:
    """Whether the address is this machine's: only then can a socket be bound to it."""
    family = socket.AF_INET if host.version == 4 else socket.AF_INET6
    with socket.socket(family, socket.SOCK_DGRAM) as tried:
        try:
            tried.bind((str(host), 0))
        except OSError:
            return False
    return True


def _named(wanted: Take) -> Decoder:
    """The decoder of a protocol that names its weights or markers."""
    return OscDecoder(wanted.source.names, wanted.source.kind, wanted.units)


PROTOCOLS: Mapping[str, NetworkProtocol] = {
    "livelink": NetworkProtocol(11111, lambda _: LiveLinkDecoder(), 11111, LiveLinkEncoder),
    "vmc": NetworkProtocol(39540, _named, 39539, VmcEncoder),
    "osc": NetworkProtocol(9000, _named, 9000, OscEncoder),
    "ifacialmocap": NetworkProtocol(49983, lambda _: IFacialMocapDecoder()),
}
INPUTS = (*PROTOCOLS, *IN_FILES)
OUTPUTS = (*(kind for kind, one in PROTOCOLS.items() if one.out_port is not None), *OUT_FILES)


def _resolve(address: Address, host: str) -> tuple[socket.AddressFamily, SocketAddress]:
    """Family and address of a host; version 4 where it has both, as most programs listen there."""
    try:
        found = socket.getaddrinfo(host, address.port, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        raise InputError(
            address.kind, "a host that is known", f"{host!r}: {error}", "Check the address."
        ) from error
    family, _, _, _, where = min(found, key=lambda entry: entry[0] != socket.AF_INET)
    return family, where
