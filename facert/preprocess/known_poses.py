"""Known poses of a character, from which others are predicted; and given controls of a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import LARGEST, FloatArray, IntArray
from facert.data.limits import bounds_of
from facert.data.take import Take
from facert.settings import LimitRule

# Beyond, more poses help little, and a new set of given controls takes longer to learn.
MOST = 500

BEYOND = 0.5
"""A limit lets a control go so far beyond the known poses, as a share of their range: without it,
errors between recordings were up to 1.24 of those with the range alone."""


@dataclass(frozen=True, eq=False)
class KnownPoses:
    """Poses of a character and what poses are clipped to."""

    poses: FloatArray  # (n, P)
    bounds: FloatArray  # (P, 2): Infinite where nothing bounds a control

    def clip(self, poses: FloatArray) -> FloatArray:
        """Poses (n, P) within the bounds."""
        return np.clip(poses, *self.bounds.T)


@dataclass(frozen=True, eq=False)
class Given:
    """Some controls of a pose."""

    controls: IntArray  # (k,): Which
    values: FloatArray  # (k,)
    soft: float = 0.0  # Standard deviation of the values; at 0 they are met exactly


def keep(labelled: FloatArray, animation: FloatArray | None, seed: int) -> FloatArray:
    """The poses that are kept of labels (l, P) and animation (n, P): `MOST`, the labels first."""
    rng = np.random.default_rng(seed)
    labels = _some(labelled, MOST, rng)
    if animation is None:
        return labels
    return np.vstack([labels, _some(animation, MOST - len(labels), rng)])


def pose_bounds(take: Take, posed: FloatArray, rule: LimitRule) -> FloatArray | None:
    """Bounds that poses are clipped to, (P, 2): the take's limits, else the range of known poses.

    These are given poses (l, P), as of the labelled frames, and all of the animation. By ``auto`` a
    limit lets a control go beyond them by `BEYOND` of their range at most, and a control without a
    limit has that range.
    """
    declared = None if take.controls is None else take.controls.limits
    if declared is not None:  # in other units, what is as good as infinite would overflow
        declared = np.where(np.abs(declared) > LARGEST, np.copysign(np.inf, declared), declared)
    if rule == "none":
        return None
    if rule == "declared":
        return declared
    poses = posed if take.animation is None else np.vstack([posed, take.animation])
    low, high = bounds_of(declared, poses).T
    farther = BEYOND * np.ptp(poses, axis=0)
    nearest, farthest = poses.min(axis=0) - farther, poses.max(axis=0) + farther
    return np.stack([np.clip(nearest, low, high), np.clip(farthest, low, high)], axis=1)


def _some(poses: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    return poses[np.sort(rng.permutation(len(poses))[:count])]
