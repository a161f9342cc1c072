"""CPU seconds of a training run, one thread.

python -m experiments.bench.training [--runs 5]
"""

from __future__ import annotations

import argparse
import time

from experiments.bench.problem import bench_take, describe
from facert import Settings, train
from facert.settings import OptimiserName


def seconds(optimizer: OptimiserName, runs: int) -> tuple[list[float], dict[str, object]]:
    """CPU seconds of each run after a warm-up, and what the last run says of itself."""
    _, take = bench_take()
    spent = []
    for _ in range(runs + 1):
        began = time.process_time()
        retargeter = train(take, Settings(optimizer=optimizer))
        spent.append(time.process_time() - began)
    return spent[1:], retargeter.figures


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    print(f"training, {bench_take()[0]}, 40 labels + 100 frames + 100 poses, {runs} runs")
    names: tuple[OptimiserName, ...] = ("lbfgs", "scg")
    for name in names:
        spent, figures = seconds(name, runs)
        print(
            f"{name:<6} {describe(spent, 's CPU')}, {figures['iterations']} iterations, "
            f"objective {figures['objective']:.1f}"
        )


if __name__ == "__main__":
    main()
