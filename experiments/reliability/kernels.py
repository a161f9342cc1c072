"""How far poses differ between processors: every method, trained and run with each one's kernels.

    python -m experiments.reliability.kernels [--methods auto,ssgpr] [--threads 1,2]
        [--training data/training.h5] [--performance data/performance.h5]

Every method learns from the same take and retargets the same performance in a process of its own
for each processor (`experiments.reliability.processors`). Printed is the largest difference of a
pose from that of the first processor, as a share of the range of its control.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from os import environ
from pathlib import Path

import numpy as np

from experiments.reliability.processors import PROCESSORS, present
from facert.methods.registry import REGISTRY

DATA = Path("data")
ONE = "experiments.reliability.kernels"


def poses(method: str, training: Path, performance: Path) -> np.ndarray:
    """Poses (T, P) of a performance by a method that has learned from a take."""
    import facert

    settings = facert.Settings(method=method, unlabelled=100, max_iterations=500)
    retargeter = facert.train(facert.read_take(training), settings)
    params = retargeter.retarget(facert.read_take(performance)).params
    assert params is not None
    return params


def measure(given: argparse.Namespace) -> None:
    """Print a line for every method."""
    counts = [int(count) for count in given.threads.split(",")]
    runs = list(present([processor.name for processor in PROCESSORS], counts))
    print("method", *(f"{processor.name}/{count}" for processor, count in runs), sep="\t")
    with tempfile.TemporaryDirectory() as folder:
        for method in given.methods.split(","):
            found = []
            for processor, count in runs:
                to = Path(folder) / f"{method}-{processor.name}-{count}.npy"
                command = [sys.executable, "-m", ONE, "--to", to, "--methods", method]
                command += ["--training", given.training, "--performance", given.performance]
                environment = environ | processor.environment(count)
                subprocess.run(command, env=environment, check=True, capture_output=True)
                found.append(np.load(to))
            extent = np.ptp(found[0], axis=0)
            ranges = np.where(extent > 0.0, extent, 1.0)
            largest = [float(np.abs((other - found[0]) / ranges).max()) for other in found]
            print(method, *(f"{share:.1e}" for share in largest), sep="\t", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--methods", default=",".join(REGISTRY), help="some of %(default)s")
    parser.add_argument("--threads", default="1", help="numbers of threads (%(default)s)")
    parser.add_argument("--training", type=Path, default=DATA / "training.h5")
    parser.add_argument("--performance", type=Path, default=DATA / "performance.h5")
    parser.add_argument("--to", type=Path, help="in this process: the file for a method's poses")
    given = parser.parse_args()
    if given.to is None:
        measure(given)
    else:
        np.save(given.to, poses(given.methods, given.training, given.performance))


if __name__ == "__main__":
    main()
