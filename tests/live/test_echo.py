"""Poses must not come back as frames."""

import socket

import pytest

from facert.data.names import ARKIT_SHAPES
from facert.errors import InputError
from facert.live.endpoints import Address, open_receiver, open_sender, refuse_echo
from facert.live.frames import Counters, frame_pattern


def is_refused(listen, host, beside=0, kind="vmc"):
    """Whether poses may not go to a host, at the port of the session's frames or beside it."""
    receiver = open_receiver(Address("vmc", "", 0), listen, frame_pattern(ARKIT_SHAPES))
    to = Address(kind, host, (receiver.port + beside) % 2**16)
    sender = open_sender(to, ARKIT_SHAPES, Counters())
    try:
        refuse_echo(receiver, sender)
    except InputError:
        return True
    finally:
        receiver.close(), sender.close()
    return False


@pytest.mark.parametrize("kind", ["vmc", "osc", "livelink"])
@pytest.mark.parametrize("listen", ["127.0.0.1", "localhost", "0.0.0.0"])
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "0.0.0.0"])
def test_the_port_that_the_session_listens_on_is_refused(listen, host, kind):
    assert is_refused(listen, host, kind=kind)
    assert not is_refused(listen, host, beside=1, kind=kind)


def test_any_address_of_this_machine_is_its_own_and_those_of_others_are_not():
    assert is_refused("0.0.0.0", "127.0.0.2")
    assert not is_refused("127.0.0.1", "127.0.0.2")
    assert not is_refused("0.0.0.0", "192.0.2.1")
    assert not is_refused("127.0.0.1", "192.0.2.1")


def test_in_version_6_as_well():
    try:
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as tried:
            tried.bind(("::1", 0))
    except OSError:
        pytest.skip("this machine has no IPv6")
    assert is_refused("::1", "::1")
    assert is_refused("::", "::1")
    assert is_refused("::", "127.0.0.1")
    assert not is_refused("::1", "127.0.0.1")
    assert not is_refused("0.0.0.0", "::1")


@pytest.mark.parametrize("listen", ["0.0.0.0", "127.0.0.1"])
@pytest.mark.parametrize("host", ["0.0.0.0", "127.0.0.1", "127.0.0.2"])
def test_what_would_come_back_is_refused_and_nothing_else(listen, host):
    """The system knows: it is asked with a packet."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind((listen, 0))
        bound.settimeout(0.2)
        bound.sendto(b"pose", (host, bound.getsockname()[1]))
        try:
            comes_back = bound.recv(10) == b"pose"
        except OSError:  # nothing came, or the system reports that the port is free
            comes_back = False
    assert is_refused(listen, host) == comes_back
