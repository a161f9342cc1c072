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


def middle(frames: int, most: int) -> slice:
    """The middle of a track, at most so many frames of it."""
    start = max(0, (frames - most) // 2)
    return slice(start, start + most)


def part(
    take: Take, frames: IntArray, labels: IntArray | None = None, poses: IntArray | None = None
) -> Take:
    """Some frames of a posed take.

    Parameters
    ----------
    take : Take
        With a pose in every frame.
    frames : array of int
    labels : array of int, optional
        Frames of the take whose poses are kept.
    poses : array of int, optional
        Frames whose poses serve as animation.
    """
    assert take.params is not None
    labelled = None if labels is None else np.isin(frames, labels)[:, None]
    return replace(
        take,
        time=take.time[frames],
        source=take.source.with_matrix(take.source.matrix[frames]),
        params=None if labelled is None else np.where(labelled, take.params[frames], np.nan),
        animation=None if poses is None else take.params[poses],
    )


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
