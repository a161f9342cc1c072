"""Live Link Face in, VMC out, over loopback between three processes: frames lost, latency, memory.

python -m experiments.bench.live [--seconds 600] [--rate 120 60] [--record]

Latency *inside* is what `facert live` itself reports: from a packet's arrival in the process until
its pose is sent. *End to end* is from the sender's call until the receiver has read the last packet
of the pose, and holds the waiting of all three processes for a core.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.sharedctypes import SynchronizedArray
from pathlib import Path
from typing import Any

import numpy as np

from experiments.bench.problem import bench_take
from facert import Settings, train
from facert.data.arrays import FloatArray
from facert.data.take import Source, Take
from facert.live.livelink_packets import PACKET_NAMES, LiveLinkEncoder

WARM = 2.0
"""Seconds at the beginning that memory is not counted of."""
PATIENCE = 5.0
CLOCK, APPLY = b"/VMC/Ext/T\0\0,f\0\0", b"/VMC/Ext/Blend/Apply"
"""Of VMC: what stands before the second of a pose, and in the last packet of one."""


@dataclass(frozen=True)
class LiveSession:
    """A running `facert live`."""

    process: subprocess.Popen[str]
    port: int

    def memory(self) -> float | None:
        """Resident MiB; None of a process that has ended."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        found = re.search(r"VmRSS:\s+(\d+)", status)
        return None if found is None else int(found[1]) / 1024


def phone_take() -> Take:
    """The problem that all benchmarks time, with tracked weights for a source."""
    name, take = bench_take()
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(take.source.matrix.shape[1], len(PACKET_NAMES)))
    matrix = (take.source.matrix - take.source.matrix.mean(axis=0)) @ mixing
    weights = 0.5 + 0.2 * matrix / np.abs(matrix).max()
    print(f"{name}, its source mixed to {len(PACKET_NAMES)} weights")
    return Take(take.time, Source(weights, PACKET_NAMES), take.controls, take.params, fps=take.fps)


def play(port: int, weights: FloatArray, rate: float, sent: SynchronizedArray) -> None:
    """Send a frame every 1 / `rate` seconds, and note when."""
    encoder, to = LiveLinkEncoder(PACKET_NAMES), ("127.0.0.1", port)
    began = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(len(sent)):
            (packet,) = encoder.encode(weights[number % len(weights)], number / rate)
            time.sleep(max(0.0, began + number / rate - time.monotonic()))
            sent[number] = time.monotonic()
            sender.sendto(packet, to)


@contextmanager
def session(model: Path, to: int, options: list[str]) -> Iterator[LiveSession]:
    """`facert live` in a process of its own."""
    command = [
        *(sys.executable, "-c", "from facert.cli.app import main; main()"),
        *("live", "-m", str(model), "--in", "livelink:0", "--json"),
        *("--out", f"vmc:127.0.0.1:{to}", *options),
    ]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        found = None
        while found is None:
            line = process.stderr.readline()
            assert line, "it ended before it listened"
            found = re.search(r"listens for .*:(\d+) ", line)
        yield LiveSession(process, int(found[1]))


def listen(engine: socket.socket, rate: float, count: int) -> FloatArray:
    """When each frame's pose had arrived, (count,); NaN if it never did.

    An engine takes microseconds to understand a packet. What would take Python longer runs on the
    sender's core, and would count as its latency: packets are only searched.
    """
    arrived, clock, missing = np.full(count, np.nan), 0.0, count
    engine.settimeout(PATIENCE)
    while missing:
        try:
            packet = engine.recv(2**16)
        except TimeoutError:
            break
        place = packet.find(CLOCK)
        if place >= 0:
            (clock,) = struct.unpack_from(">f", packet, place + len(CLOCK))
        if APPLY in packet and round(clock * rate) < count:
            arrived[round(clock * rate)] = time.monotonic()
            missing -= 1
    return arrived


class Memory(threading.Thread):
    """Looks at a process's memory now and then."""

    def __init__(self, running: LiveSession) -> None:
        super().__init__(daemon=True)
        self._running = running
        self.found: list[float] = []

    def run(self) -> None:
        """Look once a second, from `WARM` on until the process ends."""
        time.sleep(WARM)
        with suppress(OSError):
            while (held := self._running.memory()) is not None:
                self.found.append(held)
                time.sleep(1.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rate", type=float, nargs="+", default=[120.0])
    parser.add_argument("--record", action="store_true", help="record what comes in and goes out")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        take, model = phone_take(), Path(folder) / "model.safetensors"
        train(take, Settings(unlabelled=100)).save(model)
        for rate in asked.rate:
            records = f"{folder}/{rate:g}"
            files = ["--record", f"{records}-in.h5", "--out", f"h5:{records}-out.h5"]
            measure(model, take, rate, asked.seconds, files if asked.record else [])


def measure(model: Path, take: Take, rate: float, seconds: float, options: list[str]) -> None:
    """A performance of so many seconds, and what became of its frames."""
    count = round(seconds * rate)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as engine:
        engine.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**22)
        engine.bind(("127.0.0.1", 0))
        with session(model, engine.getsockname()[1], options) as running:
            sent = multiprocessing.Array("d", count)
            phone = multiprocessing.Process(
                target=play, args=(running.port, take.source.values, rate, sent)
            )
            memory = Memory(running)
            memory.start()
            phone.start()
            arrived = listen(engine, rate, count)
            phone.join()
            held = np.array(memory.found)  # before files are written
            running.process.send_signal(signal.SIGINT)
            summary = json.loads(running.process.communicate()[0])
    report(rate, summary, 1e3 * (arrived - np.array(sent)), held)


def report(rate: float, summary: dict[str, Any], delays: FloatArray, memory: FloatArray) -> None:
    load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    print(f"{len(delays)} frames at {rate:g}/s, {load}")
    counted = ", ".join(
        f"{name} {summary[name]}"
        for name in ("received", "mapped", "dropped", "late", "bad", "failed")
    )
    print(f"lost: {np.isnan(delays).sum()} ({counted})")
    inside = ", ".join(f"{name} {value:.3f}" for name, value in summary["latency_ms"].items())
    print(f"latency inside, ms: {inside}")
    median, p99, worst = np.nanpercentile(delays, [50, 99, 100])
    print(f"latency end to end, ms: median {median:.3f}, p99 {p99:.3f}, worst {worst:.3f}")
    print(f"memory, MiB: {memory[0]:.1f} at the start, {memory[-1]:.1f} at the end")


if __name__ == "__main__":
    main()
