"""One cell of `experiments.bench.growth`: a take of some size made, or a stage measured on it."""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from facert import load, read_take, train, write_take
from facert.data.arrays import FloatArray
from facert.data.take import Controls, Source, Take
from facert.models.threads import one_thread

EXPRESSIONS = 20
NOISE = 0.01  # cm
LIVE = 200  # frames that are mapped one after the other
TAKE, MODEL = "take.h5", "model.safetensors"


@dataclass(frozen=True)
class Size:
    """The size of a problem."""

    frames: int = 2_000
    markers: int = 40
    controls: int = 50
    labels: int = 40
    poses: int = 300


class Cost(NamedTuple):
    """What a stage took."""

    seconds: float
    memory: float  # MB


def make_take(size: Size, seed: int = 0) -> Take:
    """A take of that size, with labels at even distances; all draws are by the seed."""
    rng = np.random.default_rng(seed)
    strength = np.exp(-np.arange(EXPRESSIONS) / 6.0)[:, None]
    shapes = [
        strength * rng.normal(size=(EXPRESSIONS, d)) for d in (3 * size.markers, size.controls)
    ]
    speeds = rng.uniform(0.1, 2.0, size=(EXPRESSIONS, 3))  # in cycles a second
    starts = rng.uniform(0.0, 1.0, size=(EXPRESSIONS, 3))
    frames = max(size.frames, size.labels)

    def expressions(seconds: FloatArray) -> FloatArray:
        waves = np.sin(2.0 * np.pi * (seconds[:, None, None] * speeds + starts))
        return np.asarray(waves.sum(axis=2))

    def poses(seconds: FloatArray) -> FloatArray:
        return np.clip(0.3 + 0.3 * np.tanh(expressions(seconds) @ shapes[1]), 0.1, 0.7)

    time_of = np.arange(frames) / 60.0
    moved = np.tanh(0.5 * expressions(time_of)) @ shapes[0]
    moved += NOISE * rng.normal(size=moved.shape)
    rest = rng.normal(scale=5.0, size=(size.markers, 3))
    labelled = np.linspace(0, frames - 1, size.labels).round().astype(int)
    params = np.full((frames, size.controls), np.nan)
    params[labelled] = poses(time_of[labelled])
    return Take(
        time=time_of,
        source=Source(rest + moved.reshape(frames, -1, 3), _names("marker", size.markers)),
        controls=Controls(_names("control", size.controls)),
        params=params,
        animation=poses(1e4 + np.arange(size.poses)),
        fps=60.0,
        units="cm",
    )


def _names(what: str, count: int) -> tuple[str, ...]:
    return tuple(f"{what}{number}" for number in range(count))


def _train(folder: Path) -> float:
    take = read_take(folder / TAKE)
    began = time.process_time()
    model = train(take)
    seconds = time.process_time() - began
    model.save(folder / MODEL, overwrite=True)
    return seconds


def _retarget(folder: Path) -> float:
    take, model = read_take(folder / TAKE), load(folder / MODEL)
    began = time.process_time()
    model.retarget(take)
    return time.process_time() - began


def _live(folder: Path) -> float:
    """Of one frame, its standard deviation not asked for."""
    take, model = read_take(folder / TAKE), load(folder / MODEL)
    stream = model.stream(take.source.names, take.fps)
    with one_thread():
        for frame in take.source.values[:LIVE]:
            stream.step(frame)
        began = time.process_time()
        for frame in take.source.values[:LIVE]:
            stream.step(frame)
        return (time.process_time() - began) / LIVE


def _files(folder: Path) -> float:
    began = time.process_time()
    write_take(read_take(folder / TAKE), folder / "copy.h5", overwrite=True)
    return time.process_time() - began


STAGES: dict[str, Callable[[Path], float]] = {
    "train": _train,
    "retarget": _retarget,
    "live frame": _live,
    "read and write": _files,
}


def measure(stage: str, folder: Path) -> Cost:
    """A stage in this process, by the files of a folder."""
    seconds = STAGES[stage](folder)
    # What getrusage says may be of the process that started this one.
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="utf-8"))
    return Cost(seconds, float("nan") if found is None else int(found[1]) * 1024 / 1e6)


def main() -> None:
    stage, folder, size = sys.argv[1:]
    if stage == "make":
        write_take(make_take(Size(**json.loads(size))), Path(folder) / TAKE)
    else:
        print(json.dumps(measure(stage, Path(folder))))


if __name__ == "__main__":
    main()
