"""How CPU time and memory grow with every size, and the exponent of that growth.

    python -m experiments.bench.growth [--vary frames markers controls labels poses] [--largest 3]

From one ordinary problem each size is made larger while the others stay. Takes are made by code, of
twenty smooth expressions that bend markers and controls. Each cell is a process of its own with one
thread: it reads its files, and CPU seconds are those of the stage alone, once all is read; memory
is the most that the process ever held, files and libraries included. The ratio is to the ordinary
problem, measured in the same run: it holds on a busy machine as well. The exponent is that between
the two largest sizes, in CPU seconds and in memory beyond what the ordinary problem takes. Writes
results/growth.md: the parts that were asked for.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from experiments.bench.figure import machine
from experiments.bench.growth_cell import STAGES, Cost, Size
from experiments.grid import RESULTS
from experiments.report import markdown, write_text

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
LARGER = {
    "frames": (20_000, 100_000, 216_000),
    "markers": (160, 640, 6_000),
    "controls": (200, 800),
    "labels": (1_000, 3_000),
    "poses": (3_000, 30_000),
}


def costs(size: Size, stages: Sequence[str]) -> dict[str, Cost | None]:
    """Each stage in a process of its own; None for those that failed."""
    found: dict[str, Cost | None] = dict.fromkeys(stages)
    with tempfile.TemporaryDirectory() as folder:
        if _process("make", Path(folder), size) is None:
            return found
        for stage in stages:
            done = _process(stage, Path(folder), size)
            found[stage] = None if done is None else Cost(*json.loads(done.splitlines()[-1]))
            shown = "failed" if done is None else found[stage]
            print(*asdict(size).values(), stage, shown, sep="\t", flush=True)
    return found


def _process(stage: str, folder: Path, size: Size) -> str | None:
    """What a stage prints; None where it fails, which it says itself."""
    words = [stage, str(folder), json.dumps(asdict(size))]
    command = [sys.executable, "-m", "experiments.bench.growth_cell", *words]
    environment = os.environ | dict.fromkeys(THREADS, "1")
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    return done.stdout if done.returncode == 0 else None


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """The slope between the two largest sizes, where both axes are logarithms."""
    with np.errstate(divide="ignore", invalid="ignore"):
        rise = np.diff(np.log(np.maximum(costs[-2:], 1e-9)))
    return float((rise / np.diff(np.log(sizes[-2:])))[0])


def rows_of(
    name: str, stages: Sequence[str], ordinary: dict[str, Cost | None], largest: int
) -> Iterator[list[str]]:
    """The rows of the table in which one size varies."""
    base = Size()
    values = [getattr(base, name), *LARGER[name][:largest]]
    found = [ordinary, *(costs(replace(base, **{name: value}), stages) for value in values[1:])]
    for stage in stages:
        done = [
            (value, cost)
            for value, one in zip(values, found, strict=True)
            if (cost := one[stage]) is not None
        ]
        for value, one in zip(values, found, strict=True):
            yield [name, stage, f"{value:,}", *_cells(one[stage], ordinary[stage])]
        if len(done) > 1:
            sizes = [float(value) for value, _ in done]
            seconds = exponent(sizes, [cost.seconds for _, cost in done])
            first = done[0][1].memory
            beyond = [max(cost.memory - first, 1.0) for _, cost in done]
            held = f"{exponent(sizes, beyond):.2f}" if len(done) > 2 else ""
            yield [name, stage, "exponent", f"{seconds:.2f}", "", held]


def _cells(cost: Cost | None, ordinary: Cost | None) -> list[str]:
    if cost is None:
        return ["failed", "", ""]
    ratio = "" if ordinary is None else f"{cost.seconds / max(ordinary.seconds, 1e-9):.3g}"
    return [f"{cost.seconds:.3g}", ratio, f"{cost.memory:.0f}"]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--vary", nargs="+", choices=LARGER, default=[*LARGER], metavar="SIZE")
    parser.add_argument(
        "--largest", type=int, default=2, help="larger sizes, of each (%(default)s)"
    )
    parser.add_argument("--stages", nargs="+", choices=STAGES, default=[*STAGES], metavar="STAGE")
    parser.add_argument("--to", type=Path, default=RESULTS / "growth.md")
    given = parser.parse_args()
    ordinary = costs(Size(), given.stages)
    rows = [
        row for name in given.vary for row in rows_of(name, given.stages, ordinary, given.largest)
    ]
    header = ["size", "stage", "value", "CPU s", "ratio", "peak MB"]
    where = ", ".join(f"{name} {value}" for name, value in machine().items())
    about = (
        "From "
        + ", ".join(f"{value:,} {name}" for name, value in asdict(Size()).items())
        + f" one size at a time. A cell is a process of its own on one thread; {where}."
    )
    write_text(given.to, ["# How costs grow", about, markdown(header, rows, texts=3)])
    print(given.to.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
