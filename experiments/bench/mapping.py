"""Milliseconds to map a frame, one thread: frame by frame with the temporal term, and in one batch.

python -m experiments.bench.mapping [--frames 2000]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from experiments.bench.problem import bench_take, describe
from facert import Settings, Take, train
from facert.data import FloatArray
from facert.methods.base import Method
from facert.threads import threads_for


def frame_by_frame(method: Method, frames: FloatArray) -> FloatArray:
    """CPU milliseconds of each frame in a stream."""
    stream = method.stream()
    spent = np.empty(len(frames))
    with threads_for(1):
        for row in range(len(frames)):
            began = time.process_time_ns()
            stream.step(frames[row : row + 1])
            spent[row] = (time.process_time_ns() - began) / 1e6
    return spent[10:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=2000)
    count = parser.parse_args().frames
    name, take = bench_take()
    print(f"mapping, {name}, up to {count} frames, 40 labels + 100 frames + 100 poses")
    for method in ("auto", "ssgplvm"):
        measure(take, method, count)


def measure(take: Take, name: str, count: int) -> None:
    retargeter = train(take, Settings(method=name, unlabelled=100))
    clean = retargeter.source_units.apply(take.source.matrix)[:count]
    hidden = np.random.default_rng(0).random((len(clean), clean.shape[1] // 3)) < 0.3
    gappy = np.where(np.repeat(hidden, 3, axis=1), np.nan, clean)
    for label, frames in ((f"{name}, all markers", clean), (f"{name}, 30 % missing", gappy)):
        spent = frame_by_frame(retargeter.method, frames)
        print(
            f"{label:<21} frame by frame: median {np.median(spent):.3f} ms, "
            f"p99 {np.percentile(spent, 99):.3f} ms CPU"
        )
        rates = []
        for _ in range(5):
            began = time.process_time()
            retargeter.method.predict(frames)
            rates.append(len(frames) / (time.process_time() - began))
        print(f"{label:<21} in one batch:   {describe(rates, 'frames/s CPU')}")


if __name__ == "__main__":
    main()
