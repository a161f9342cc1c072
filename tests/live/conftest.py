"""Fixtures of live sessions: real sockets on loopback, at ports that the system chooses."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from facert.data.names import ARKIT_NAMES
from facert.live.endpoints import Address, open_receiver
from facert.live.frames import Frame, frame_pattern
from facert.live.livelink_packets import LiveLinkEncoder
from facert.retarget.stream import Streamed

PATIENCE = 20.0
"""Seconds after which a packet on loopback is taken for lost."""


class Phone:
    """Sends Live Link frames from a socket of its own."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.address = ("127.0.0.1", port)
        self._encoder = LiveLinkEncoder(ARKIT_NAMES)

    def packet(self, number: int, value: float = 0.5) -> bytes:
        """The packet of a frame, 60 a second, all shapes at one value."""
        return self._encoder.encode(np.full(len(ARKIT_NAMES), value), number / 60)[0]

    def send(self, raw: bytes) -> None:
        self.socket.sendto(raw, self.address)


class Plain:
    """A mapper without a memory."""

    def __init__(self, step: Callable[[Frame], Streamed]) -> None:
        self.step = step
        self.prepared = 0
        self.rehearsed: list[float] = []

    def prepare(self) -> None:
        self.prepared += 1

    def rehearse(self, frame: Frame) -> Streamed:
        self.rehearsed.append(frame.time)
        return self.step(frame)


@pytest.fixture(scope="session")
def plain() -> type[Plain]:
    """Makes a mapper of a function from a frame to its pose."""
    return Plain


@pytest.fixture
def receiver(monkeypatch):
    """Live Link on a free port, on a machine that may be busy with something else for a while."""
    monkeypatch.setattr("facert.live.order.SILENCE", 2 * PATIENCE)
    opened = open_receiver(
        Address("livelink", "127.0.0.1", 0), "127.0.0.1", frame_pattern(ARKIT_NAMES)
    )
    yield opened
    opened.close()


@pytest.fixture
def phone(receiver) -> Iterator[Phone]:
    """A sender to `receiver`."""
    made = Phone(receiver.port)
    yield made
    made.socket.close()


@pytest.fixture
def collect(receiver) -> Callable[[int], list[Frame]]:
    """Waits for so many frames."""

    def wait(count: int) -> list[Frame]:
        frames: list[Frame] = []
        while len(frames) < count:
            found = receiver.wait(PATIENCE)
            assert found, f"{len(frames)} of {count} frames came"
            frames += found
        return frames

    return wait
