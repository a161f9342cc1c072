"""A whole take through noise and gaps: offline in one go, and frame by frame as a stream.

python -m experiments.bench.retargeting [--runs 5]
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from experiments.bench.problem import bench_take, describe
from facert import Settings, Source, Take, train
from facert.models.threads import threads_for

NOISE, HIDDEN = 0.05, 0.3


def spoilt(take: Take, seed: int) -> Take:
    """The take with noise, and so many of its markers hidden."""
    rng = np.random.default_rng(seed)
    X = take.source.matrix
    noisy = X + NOISE * X.std(axis=0).max() * rng.standard_normal(X.shape)
    values = noisy.reshape(take.source.values.shape)
    hidden = rng.random(values.shape[:2]) < HIDDEN
    return replace(
        take, source=Source(np.where(hidden[..., None], np.nan, values), take.source.names)
    )


def shaken(take: Take, seed: int) -> Take:
    """A take that is hardly different, but whose cleaning nothing remembers."""
    values = take.source.values
    moved = 1e-9 * np.random.default_rng(seed).standard_normal(values.shape)
    return replace(take, source=Source(values + moved, take.source.names))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    name, take = bench_take()
    gappy = spoilt(take, 0)
    retargeter = train(gappy, Settings(unlabelled=100))
    print(f"auto, {name}, {len(take)} frames, noise {NOISE:g}")
    for label, source in (("all markers", take), (f"{HIDDEN:.0%} hidden", gappy)):
        spent = []
        for seed in range(1, runs + 1):
            fresh = shaken(source, seed)
            began = time.process_time()
            retargeter.retarget(fresh)
            spent.append(time.process_time() - began)
        print(f"{label:<12} offline: {describe(spent, 's CPU')}")
        stream, each = retargeter.stream(source.source.names, source.fps), []
        with threads_for(1):
            for frame in source.source.values:
                began = time.process_time()
                stream.step(frame)
                each.append(1e3 * (time.process_time() - began))
        print(
            f"{label:<12} live:    median {np.median(each):.3f} ms, "
            f"p99 {np.percentile(each, 99):.3f} ms CPU"
        )


if __name__ == "__main__":
    main()
