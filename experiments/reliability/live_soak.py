"""A live session under fire: a million frames as fast as they go, among all that must not matter.

Over loopback UDP a phone sends frame after frame, and between them garbage, copies, frames from
before, cut ones, absurd values and those of a second phone; now and then it begins again. The
session maps, sends and records. Printed are its memory as it goes, and its counters, which must add
up.

    python -m experiments.reliability.live_soak [FRAMES]
"""

from __future__ import annotations

import logging
import multiprocessing
import socket
import struct
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from facert import Controls, Settings, Source, Take, train
from facert.data.names import ARKIT_NAMES
from facert.io.formats import read_take_file
from facert.live.endpoints import Address, open_receiver, open_sender
from facert.live.frames import frame_pattern
from facert.live.live_model import LiveModel, ModelFile
from facert.live.livelink_packets import LiveLinkEncoder
from facert.live.loop import Limits, LiveSession
from facert.live.recording import Recordings
from facert.retarget.options import RetargetOptions

FRAMES = 1_000_000
WINDOW = 64
"""Frames that are under way at most: the system drops what nobody fetches, without a count."""
BESIDE = 7  # of so many frames, one is followed by each kind of what must not matter
SECONDS = 0.3  # of silence after which the phone begins anew


def main() -> None:
    """Run the soak, and print what it came to."""
    logging.disable(logging.WARNING)
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    with tempfile.TemporaryDirectory() as folder:
        soak(frames, Path(folder))


def soak(frames: int, folder: Path) -> None:
    """Send frames to a session that records, and compare what it counted with what was sent."""
    model = folder / "model.safetensors"
    retargeter = train(_take(), Settings(method="ridge"))
    retargeter.save(model)
    receiver = open_receiver(
        Address("livelink", "127.0.0.1", 0), "127.0.0.1", frame_pattern(ARKIT_NAMES)
    )
    poses = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    poses.bind(("127.0.0.1", 0))
    to = Address("osc", "127.0.0.1", poses.getsockname()[1])
    sender = open_sender(to, retargeter.controls.names, receiver.counters)
    recordings = Recordings(
        receiver.pattern, retargeter.source_names, retargeter.controls, overwrite=False
    )
    files = [recordings.poses(folder / "poses.h5")]
    kept = recordings.source(folder / "source.h5")
    received = multiprocessing.Value("q", 0)
    sent = multiprocessing.Array("q", 2)
    phone = multiprocessing.Process(
        target=_send, args=(receiver.port, frames, received, sent), daemon=True
    )
    progress = Progress(receiver, received, frames)
    with LiveModel(
        ModelFile(model), retargeter, receiver.pattern, None, lambda _: RetargetOptions()
    ) as mapper:
        session = LiveSession(receiver, mapper, [sender], files, kept)
        phone.start()
        session.run(Limits(seconds=7200), lambda: not phone.is_alive(), progress.show)
    progress.line()
    print(receiver.counters)
    _check(receiver.counters, tuple(sent), frames, recordings.going_on)
    recordings.close()


class Progress:
    """Tells the phone how far the session is, and prints its memory ten times."""

    def __init__(self, receiver, received, frames: int) -> None:
        self._receiver, self._received = receiver, received
        self._step, self._next = frames // 10, 0
        self._began = time.perf_counter()

    def show(self) -> None:
        """Called by the session whenever nothing waits."""
        count = self._receiver.counters.received
        self._received.value = count
        if count >= self._next:
            self.line()
            self._next += self._step

    def line(self) -> None:
        """Print one line."""
        count = self._receiver.counters.received
        seconds = time.perf_counter() - self._began
        print(f"{count:>9} frames, {seconds:6.0f} s, {_resident():6.1f} MiB", flush=True)


def _check(counters, sent, frames: int, paths) -> None:
    """Compare counters, packets and recordings."""
    packets, garbage = sent
    counted = counters.received + counters.hidden + counters.unknown + counters.late + counters.bad
    print(f"{packets} packets sent, {garbage} of them no frames in turn; {counted} counted")
    assert counted <= packets
    assert counters.received <= frames
    assert counters.received == counters.mapped + counters.dropped + counters.failed
    poses, source = (len(read_take_file(path)) for path in paths)
    print(f"recorded: {source} frames, {poses} poses")
    assert (source, poses) == (counters.received, counters.mapped)
    print(f"lost by the system: {packets - counted}")


def _send(port: int, frames: int, received, sent) -> None:
    """The phone, a second one, and what else comes along."""
    rng = np.random.default_rng(0)
    here, there = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    for one in (here, there):
        one.connect(("127.0.0.1", port))
    encoder, other = LiveLinkEncoder(ARKIT_NAMES), LiveLinkEncoder(ARKIT_NAMES)
    other._head = other._head[:-6] + b"second"  # the name of its subject
    before = b""
    for number in range(frames):
        values = rng.random(len(ARKIT_NAMES))
        packet = encoder.encode(values, number / 1e4)[0]
        here.send(packet)
        sent[0] += 1
        if number % BESIDE == 0:
            beside = [
                packet,  # a copy
                before or packet,  # from before
                rng.bytes(int(rng.integers(1, 400))),
                packet[: int(rng.integers(0, len(packet)))],
                packet[:-4] + struct.pack("!f", 1e38),
                packet[:-4] + struct.pack("!f", np.nan),
                packet[:-4] + struct.pack("!f", -np.inf),
                other.encode(values, number / 1e4)[0],
            ]
            for raw in beside:
                (there if raw is beside[-1] else here).send(raw)
            sent[0] += len(beside)
            sent[1] += len(beside)
        before = packet
        if number % (frames // 5) == frames // 10:
            time.sleep(SECONDS)
            encoder = LiveLinkEncoder(ARKIT_NAMES)
        _wait(number, received)
    time.sleep(1)


def _wait(number: int, received) -> None:
    """Wait until the session has come near, or stands still: what was lost comes no more."""
    end = time.perf_counter() + 0.05
    while received.value < number - WINDOW and time.perf_counter() < end:
        time.sleep(0.0002)


def _take() -> Take:
    rng = np.random.default_rng(1)
    weights = rng.random((60, len(ARKIT_NAMES)))
    controls = Controls(("jaw", "smile", "brow", "blink"))
    return Take(
        np.arange(60) / 60, Source(weights, ARKIT_NAMES), controls, rng.random((60, 4)), fps=60
    )


def _resident() -> float:
    """Memory of this process in MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


if __name__ == "__main__":
    main()
