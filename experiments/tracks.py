"""The real tracks as few-shot problems, drawn as in section 3 of Bouaziz and Pauly (2014)."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from facert import Take, read_take
from facert.data.arrays import FloatArray, IntArray

DATA = Path(os.environ.get("FACERT_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))


def read_track(name: str, target: str) -> Take:
    """A track with the true pose in every frame."""
    return read_take(DATA / "tracks" / f"{name}.npz", target=target)


def draw(take: Take, labels: int, unlabelled: int, seed: int) -> tuple[Take, IntArray]:
    """A take with so many posed frames, and the frames to test on.

    Labels and the unlabelled poses come from different random frames. Test frames are all those
    whose true pose training does not see.
    """
    assert take.params is not None
    order = np.random.default_rng(seed).permutation(len(take))
    posed, animated = order[:labels], order[labels : labels + unlabelled]
    params: FloatArray = np.full_like(take.params, np.nan)
    params[posed] = take.params[posed]
    animation = take.params[animated] if unlabelled else None
    return replace(take, params=params, animation=animation), np.sort(order[labels + unlabelled :])
