"""CPU seconds of a training run, one thread: the default, and the shared model twice.

python -m experiments.bench.training [--runs 5]
"""

from __future__ import annotations

import argparse
import time

from experiments.bench.problem import bench_take, describe
from facert import Settings, train

KINDS = {
    "auto": Settings(unlabelled=100),
    "ssgplvm, lbfgs": Settings(method="ssgplvm"),
    "ssgplvm, scg": Settings(method="ssgplvm", optimizer="scg"),
}


def seconds(settings: Settings, runs: int) -> tuple[list[float], dict[str, object]]:
    """CPU seconds of each run after a warm-up, and what the last run says of itself."""
    _, take = bench_take()
    spent = []
    for _ in range(runs + 1):
        began = time.process_time()
        retargeter = train(take, settings)
        spent.append(time.process_time() - began)
    return spent[1:], retargeter.figures


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    print(f"training, {bench_take()[0]}, 40 labels + 100 frames + 100 poses, {runs} runs")
    for name, settings in KINDS.items():
        spent, figures = seconds(settings, runs)
        steps = ""
        if "iterations" in figures:
            steps = f", {figures['iterations']} iterations, objective {figures['objective']:.1f}"
        print(f"{name:<15} {describe(spent, 's CPU')}{steps}")


if __name__ == "__main__":
    main()
