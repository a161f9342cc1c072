"""The problem that both benchmarks time: 40 labels, 100 unlabelled frames and poses."""

from __future__ import annotations

import numpy as np
import torch
from threadpoolctl import threadpool_limits

from experiments.tracks import DATA, draw, read_track
from facert import Take

# One BLAS thread, as everywhere in facert for problems of this size.
torch.set_num_threads(1)
threadpool_limits(1)


def bench_take() -> tuple[str, Take]:
    """The `rom` track, target `arkit`; the built-in take where there are no recordings."""
    if (DATA / "tracks").is_dir():
        return "rom, arkit", draw(read_track("rom", "arkit"), labels=40, unlabelled=100, seed=0)[0]
    from facert.demo import training_take

    return "built-in take", training_take()


def describe(values: list[float], unit: str) -> str:
    """Median and range of repeated measurements."""
    return f"median {np.median(values):.3f} {unit} (min {min(values):.3f}, max {max(values):.3f})"
