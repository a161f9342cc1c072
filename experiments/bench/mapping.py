"""CPU time to map a frame, one thread: one after the other as in a stream, and in one batch.

Methods trained on 40 labels + 100 frames + 100 poses, with all markers and with 30 % hidden; the
shared model with marker noise as well.
"""

from __future__ import annotations

import time

import numpy as np

from experiments.bench.figure import Figure, cpu_seconds
from experiments.bench.problem import bench_data, bench_frames
from facert import Settings
from facert.data.arrays import FloatArray
from facert.methods.base import Method
from facert.methods.registry import make_method
from facert.models.threads import threads_for

METHODS = ("auto", "ssgplvm", "ssgpr", "gpr", "svr")
PAPER = 30.0  # ms, the least that it reports
FRAMES, WARM = 1000, 10
NOISE = 0.1  # normalised units


def stream_milliseconds(method: Method, frames: FloatArray) -> list[float]:
    """Of each frame in a stream, but for the first few."""
    stream, spent = method.stream(), []
    with threads_for(1):
        for row in range(len(frames)):
            began = time.process_time_ns()
            stream.step(frames[row : row + 1])
            spent.append((time.process_time_ns() - began) / 1e6)
    return spent[WARM:]


def figures(runs: int) -> list[Figure]:
    """Of every method."""
    clean = bench_frames()[:FRAMES]
    rng = np.random.default_rng(0)
    hidden = np.repeat(rng.random((len(clean), clean.shape[1] // 3)) < 0.3, 3, axis=1)
    kinds = {"all markers": clean, "30 % missing": np.where(hidden, np.nan, clean)}
    found = []
    for name in METHODS:
        method = make_method(Settings(method=name, unlabelled=100))
        method.fit(*bench_data())
        for kind, frames in kinds.items():
            spent = [t for _ in range(runs) for t in stream_milliseconds(method, frames)]
            found.append(
                Figure.of(f"stream, {name}, {kind}", spent, "ms a frame", "the paper", [PAPER])
            )
        if name == "ssgplvm":
            kinds = {**kinds, "noise": clean + NOISE * rng.normal(size=clean.shape)}
        found += [batch(method, f"batch, {name}, {kind}", x, runs) for kind, x in kinds.items()]
        kinds.pop("noise", None)
    return found


def batch(method: Method, what: str, frames: FloatArray, runs: int) -> Figure:
    """Microseconds a frame when all are mapped at once."""
    times = cpu_seconds({what: lambda: method.predict(frames)}, runs)[what]
    each = [1e6 * t / len(frames) for t in times]
    return Figure.of(what, each, "µs a frame", "the paper", [1e3 * PAPER])
