"""How right standard deviations are: those of poses and of cleaned markers, seen and hidden.

    python -m experiments.uncertainty [--frames 1500]

Part of the face, then another, is hidden for a while, as `experiments.cleaning` hides regions. From
labels in the same take all its other frames are retargeted as facert does by default. *Predicted*
is the root mean square of the standard deviations, *error* that of the errors; *within* is the
share of errors that are less than two standard deviations, 95 % of a normal distribution.

Writes `experiments/results/uncertainty.md`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import product

import numpy as np
from threadpoolctl import threadpool_limits

import facert
from experiments.grid import OPTICAL, RESULTS, SPEECH, kinds
from experiments.report import markdown, write_text
from experiments.robustness import Cell, spoil
from facert import Settings
from facert.data.arrays import FloatArray, rms

NOISES = (0.0, 0.05)
SHARE = 0.2  # of the markers, on average, that are hidden
HEADER = ("what", "track", "noise", "error", "predicted", "predicted / error", "within")


def shown(what: str, cell: Cell, error: FloatArray, std: FloatArray) -> tuple[str, ...]:
    """A row of the table."""
    off, predicted = rms(error), rms(std)
    within = float(np.mean(np.abs(error) < 2.0 * std))
    numbers = (f"{off:.4f}", f"{predicted:.4f}", f"{predicted / off:.2f}", f"{within:.0%}")
    return (what, f"{cell.track}, {cell.target}", f"{cell.noise:g}", *numbers)


def measured(cell: Cell) -> Iterator[tuple[str, ...]]:
    """Rows for poses of frames that show all and of others, and for hidden markers."""
    spoilt = spoil(cell)
    result = facert.train(spoilt.take, Settings(seed=cell.seed)).retarget(spoilt.take)
    assert result.params is not None
    assert result.std is not None
    assert result.source.std is not None
    assert spoilt.truth.params is not None
    hidden = spoilt.problem.hidden
    gappy = hidden.any(axis=1)[spoilt.test]
    error = (result.params - spoilt.truth.params)[spoilt.test]
    for what, rows in (("poses, all shown", ~gappy), ("poses, part hidden", gappy)):
        yield shown(what, cell, error[rows], result.std[spoilt.test][rows])
    off = spoilt.units.apply(result.source.matrix) - spoilt.problem.truth
    std = result.source.std.reshape(off.shape) / spoilt.units.scale
    yield shown("hidden markers", cell, off[hidden], std[hidden])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1500)
    given = parser.parse_args()
    rows = []
    with threadpool_limits(1):
        for (track, target), noise in product(kinds((*SPEECH, *OPTICAL)), NOISES):
            for row in measured(Cell(track, target, "region", SHARE, noise, 0, given.frames)):
                rows.append(row)
                print(*row, sep="  ", flush=True)
    note = (
        "Regions hidden, 20 % of the markers on average; 20 labels, 100 other poses. Poses in "
        "their own units, markers in the largest standard deviation of a coordinate. Written by "
        "`python -m experiments.uncertainty`."
    )
    table = markdown(HEADER, sorted(rows), texts=2)
    write_text(RESULTS / "uncertainty.md", ["# How right standard deviations are", note, table])


if __name__ == "__main__":
    main()
