"""The same training on other processors, in other units and with other seeds: the same poses.

    python -m experiments.reliability.determinism [--methods ssgplvm svr] [--tracks utterance_a]

Every method learns from a stretch of a real track with random labels, in processes whose BLAS and
torch use other instructions and numbers of threads, and with markers or controls in other units.
A figure is the largest difference of any control in any frame, relative to its range. The last
column is the same for another seed, which draws other unlabelled frames.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

import facert
from experiments.grid import RESULTS, TARGETS
from experiments.report import markdown, write_text
from experiments.tracks import draw, middle, part, read_track
from facert.data.arrays import FloatArray
from facert.data.take import Take
from facert.methods.registry import REGISTRY

FRAMES, LABELS = 700, 20
PROCESSORS: Mapping[str, Mapping[str, str]] = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott", "ATEN_CPU_CAPABILITY": "default"},
    "2 threads": {"OPENBLAS_CORETYPE": "Haswell", "OMP_NUM_THREADS": "2"},
}
UNITS = (2.54, 0.01, 1e6)


def main() -> None:
    given = _options()
    if given.into is not None:
        for method in given.methods:
            np.save(given.into / f"{method}.npy", _poses(_take(given.tracks[0]), method))
        return
    columns = [*PROCESSORS][1:]
    columns += [f"{what} x {unit:g}" for what in ("markers", "controls") for unit in UNITS]
    rows = []
    for track in given.tracks:
        elsewhere = {name: _in(given, track, name) for name in PROCESSORS}
        for method in given.methods:
            found = _differences(track, method, elsewhere)
            rows.append([track, method, *(f"{one:.0e}" for one in found)])
            print(*rows[-1], flush=True)
    about = f"{FRAMES} frames, {LABELS} labels; processors against {next(iter(PROCESSORS))}."
    table = markdown(["track", "method", *columns, "another draw"], rows, texts=2)
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


def _in(given: argparse.Namespace, track: str, processor: str) -> dict[str, FloatArray]:
    """Poses of all methods in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "experiments.reliability.determinism"]
        options = ["--tracks", track, "--into", folder, "--methods", *given.methods]
        settings = {"OMP_NUM_THREADS": "1", **PROCESSORS[processor]}
        subprocess.run([*command, *options], env=os.environ | settings, check=True)
        return {method: np.load(Path(folder) / f"{method}.npy") for method in given.methods}


def _differences(
    track: str, method: str, elsewhere: Mapping[str, Mapping[str, FloatArray]]
) -> list[float]:
    take = _take(track)
    first, *others = (elsewhere[name][method] for name in PROCESSORS)
    assert take.params is not None  # of a track
    ranges = np.ptp(take.params, axis=0)
    ranges[ranges == 0.0] = np.inf  # a control that never moves
    here = _poses(take, method)
    found = [np.abs(one - first) for one in others]
    for unit in UNITS:
        markers = replace(take, source=take.source.with_matrix(take.source.matrix * unit))
        found.append(np.abs(_poses(markers, method) - here))
    for unit in UNITS:
        controls = replace(take, params=take.params * unit)
        found.append(np.abs(_poses(controls, method) / unit - here))
    found.append(np.abs(_poses(take, method, seed=1) - here))
    return [float((one / ranges).max()) for one in found]


def _take(track: str) -> Take:
    """A stretch of a track with its true poses."""
    take = read_track(track, TARGETS[track][0])
    frames = np.arange(len(take))[middle(len(take), FRAMES)]
    assert take.params is not None  # of a track
    return replace(part(take, frames), params=take.params[frames])


def _poses(truth: Take, method: str, seed: int = 0) -> FloatArray:
    """The poses of all frames by a method that learned from some."""
    given, _ = draw(truth, LABELS, 100, seed=0)
    trained = facert.train(given, facert.Settings(method=method, seed=seed))
    found = trained.retarget(replace(given, params=None, animation=None)).params
    assert found is not None  # retarget poses every frame
    return found


if __name__ == "__main__":
    main()
