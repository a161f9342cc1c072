"""Known poses of a character, from which others are predicted; and given controls of a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.limits import bounds_of
from facert.data.take import Take
from facert.settings import LimitRule

# Beyond, more poses help little, and a new set of given controls takes longer to learn.
MOST = 500


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

    These are given poses (l, P), as of the labelled frames, and all of the animation. A control
    without a limit has the range of its poses, as long as the rule is no other.
    """
    declared = None if take.controls is None else take.controls.limits
    if rule == "none":
        return None
    if rule == "declared":
        return declared
    return bounds_of(
        declared, posed if take.animation is None else np.vstack([posed, take.animation])
    )


def _some(poses: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    return poses[np.sort(rng.permutation(len(poses))[:count])]
