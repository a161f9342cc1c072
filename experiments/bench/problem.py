"""The problem that all benchmarks time: 40 labels, 100 unlabelled frames and poses."""

from __future__ import annotations

from functools import cache

import numpy as np
import torch
from threadpoolctl import threadpool_limits

from experiments.tracks import DATA, draw, read_track
from facert import Take
from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.methods.base import Labelled, Unlabelled
from facert.preprocess.training_set import choose_training_set
from facert.settings import Settings

# One BLAS thread, as everywhere in facert for problems of this size.
torch.set_num_threads(1)
threadpool_limits(1)


@cache
def bench_take() -> tuple[str, Take]:
    """The `rom` track, target `arkit`; the built-in take where there are no recordings."""
    if (DATA / "tracks").is_dir():
        return "rom, arkit", draw(read_track("rom", "arkit"), labels=40, unlabelled=100, seed=0)[0]
    from facert.demo import training_take

    return "built-in take", training_take()


@cache
def bench_data() -> tuple[Labelled, Unlabelled]:
    """What a method is trained on, in normalised units."""
    data = choose_training_set(bench_take()[1], Settings(unlabelled=100))
    x, y = _units()
    return (
        Labelled(x.apply(data.X_labelled), y.apply(data.Y_labelled)),
        Unlabelled(x.apply(data.X_unlabelled), y.apply(data.Y_unlabelled)),
    )


def bench_frames() -> FloatArray:
    """Every frame of the take, in normalised units."""
    return _units()[0].apply(bench_take()[1].source.matrix)


@cache
def _units() -> tuple[Normalisation, Normalisation]:
    data = choose_training_set(bench_take()[1], Settings(unlabelled=100))
    frames = np.vstack([data.X_labelled, data.X_unlabelled])
    poses = np.vstack([data.Y_labelled, data.Y_unlabelled])
    return Normalisation.of(frames, "source"), Normalisation.of(poses, "target")


def describe(values: list[float], unit: str) -> str:
    """Median and range of repeated measurements."""
    return f"median {np.median(values):.3f} {unit} (min {min(values):.3f}, max {max(values):.3f})"
