"""The same training on other processors, in other units and with other seeds: the same poses.

    python -m experiments.reliability.determinism [--methods ssgplvm svr] [--tracks utterance_a]

Every method learns from a stretch of a real track with random labels, in processes that stand for
other processors and numbers of threads (`experiments.reliability.processors`), and with markers or
controls in other units. A figure is the largest difference of any control in any frame, relative to
its range. The last columns are the same for another seed: where all unlabelled frames and poses are
learned from, and where the seed draws half of them.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import facert
from experiments.grid import RESULTS, TARGETS
from experiments.reliability.processors import PROCESSORS, present
from experiments.report import markdown, write_text
from experiments.tracks import draw, middle, part, read_track
from facert.data.arrays import FloatArray
from facert.data.take import Take
from facert.methods.registry import REGISTRY

FRAMES, LABELS, UNLABELLED = 320, 20, 100
THREADS = (1, 2)
UNITS = (2.54, 1e6)


def main() -> None:
    given = _options()
    if given.into is not None:
        for method in given.methods:
            np.save(given.into / f"{method}.npy", _poses(_take(given.tracks[0]), method))
        return
    runs = {
        f"{processor.name}, {count}": processor.environment(count)
        for processor, count in present([processor.name for processor in PROCESSORS], [*THREADS])
    }
    columns = [*list(runs)[1:]]
    columns += [f"{what} x {unit:g}" for what in ("markers", "controls") for unit in UNITS]
    columns += ["another seed", "another draw"]
    rows = []
    for track in given.tracks:
        elsewhere = [_in(given, track, environment) for environment in runs.values()]
        for method in given.methods:
            found = _differences(track, method, [one[method] for one in elsewhere])
            rows.append([track, method, *(f"{one:.0e}" for one in found)])
            print(*rows[-1], sep="\t", flush=True)
    about = (
        f"{FRAMES} frames, {LABELS} labels, {UNLABELLED} other poses; processors, and numbers of"
        f" threads, against {next(iter(runs))}."
    )
    table = markdown(["track", "method", *columns], rows, texts=2)
    write_text(given.results / "determinism.md", ["# The same poses anywhere", about, table])


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tracks", nargs="+", choices=TARGETS, default=list(TARGETS))
    parser.add_argument("--methods", nargs="+", choices=REGISTRY, default=list(REGISTRY))
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder (%(default)s)")
    parser.add_argument("--into", type=Path, help=argparse.SUPPRESS)  # of a process of its own
    return parser.parse_args()


def _in(
    given: argparse.Namespace, track: str, environment: dict[str, str]
) -> dict[str, FloatArray]:
    """Poses of all methods in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "experiments.reliability.determinism"]
        options = ["--tracks", track, "--into", folder, "--methods", *given.methods]
        subprocess.run([*command, *options], env=os.environ | environment, check=True)
        return {method: np.load(Path(folder) / f"{method}.npy") for method in given.methods}


def _differences(track: str, method: str, elsewhere: list[FloatArray]) -> list[float]:
    take = _take(track)
    assert take.params is not None  # of a track
    ranges = np.ptp(take.params, axis=0)
    ranges[ranges == 0.0] = np.inf  # a control that never moves
    first, *others = elsewhere
    found = [one - first for one in others]
    found += _here(take, method)
    return [float((np.abs(one) / ranges).max()) for one in found]


def _here(take: Take, method: str) -> Iterator[FloatArray]:
    """What units, the seed and the draw change, in this process."""
    assert take.params is not None  # of a track
    usual = _poses(take, method)
    for unit in UNITS:
        markers = replace(take, source=take.source.with_matrix(take.source.matrix * unit))
        yield _poses(markers, method) - usual
    for unit in UNITS:
        controls = replace(take, params=take.params * unit)
        yield _poses(controls, method) / unit - usual
    yield _poses(take, method, seed=1) - usual
    one, other = (_poses(take, method, UNLABELLED // 2, seed) for seed in (0, 1))
    yield other - one


def _take(track: str) -> Take:
    """A stretch of a track with its true poses."""
    take = read_track(track, TARGETS[track][0])
    frames = np.arange(len(take))[middle(len(take), FRAMES)]
    assert take.params is not None  # of a track
    return replace(part(take, frames), params=take.params[frames])


def _poses(truth: Take, method: str, unlabelled: int = FRAMES, seed: int = 0) -> FloatArray:
    """The poses of all frames by a method that learned from some."""
    given, _ = draw(truth, LABELS, UNLABELLED, seed=0)
    trained = facert.train(given, facert.Settings(method=method, seed=seed, unlabelled=unlabelled))
    found = trained.retarget(replace(given, params=None, animation=None)).params
    assert found is not None  # retarget poses every frame
    return found


if __name__ == "__main__":
    main()
