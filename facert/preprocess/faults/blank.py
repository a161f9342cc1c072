"""Frames of weights without a face: a placeholder, which comes and goes with a jump.

Trackers write zeros, or another number for all weights, while they see no face. A character that
rests at zero comes to rest: the last step is as small as those before it, or, where a performance
is a sequence of poses, all its steps are as large. Where the weights of other frames are hardly
ever at the number, all of them at once show that no face was seen, and a smaller jump is enough.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray

FEWEST = 3
"""Weights; fewer may well be the same."""
MOST = 0.5
"""Where more of the frames are alike than this share, the face rests at that."""
JUMP = 3.0
"""A jump is so many times as large as the steps around it, and as steps are."""
AROUND = 5
"""So many steps are looked at on either side."""
CHANCE, MANY = 1e-6, 10
"""So many weights are hardly all at a number by chance, if each is as rarely there as else."""
LESS = 1.5
"""A jump on either side is then enough, of so many times the steps around it."""
LASTING = 10
"""Frames; one weight or other repeats by chance for a few."""


@dataclass(frozen=True, eq=False)
class _Steps:
    """Distances from each frame to the next, (T - 1,)."""

    lengths: FloatArray  # NaN where nothing was observed
    counted: BoolArray  # Those between frames that are not set apart: what is usual
    usual: float

    @classmethod
    def of(cls, weights: FloatArray, apart: BoolArray) -> _Steps:
        """The steps of frames (T, D), some of which are set apart, (T,)."""
        changes = np.diff(weights, axis=0)
        lengths = np.linalg.norm(np.nan_to_num(changes), axis=1)
        lengths[np.isnan(changes).all(axis=1)] = np.nan
        counted = ~apart[1:] & ~apart[:-1] & ~np.isnan(lengths)
        moving = lengths[counted & (lengths > 0.0)]
        return cls(lengths, counted, float(np.median(moving)) if len(moving) else 0.0)

    def jump_after(self, frame: int) -> bool:
        """Whether there is a jump after a frame; not after the last one."""
        return self._goes(frame, JUMP) is True

    def jump_around(self, first: int, last: int) -> bool:
        """Whether frames come and go with a jump, as far as the take shows that."""
        shown = self._ends(first, last, JUMP)
        return bool(shown) and all(shown)

    def jump_beside(self, first: int, last: int) -> bool:
        """Whether frames come or go with a jump, if a small one, or nothing is known of either."""
        shown = self._ends(first, last, LESS)
        return not shown or any(shown)

    def _ends(self, first: int, last: int, times: float) -> list[bool]:
        """Whether frames come and whether they go with a jump, without what is not known."""
        comes = self._is_jump(first - 1, slice(max(first - AROUND, 0), first - 1), times)
        return [is_jump for is_jump in (comes, self._goes(last, times)) if is_jump is not None]

    def _goes(self, frame: int, times: float) -> bool | None:
        return self._is_jump(frame, slice(frame + 1, frame + AROUND), times)

    def _is_jump(self, step: int, around: slice, times: float) -> bool | None:
        """Whether a step is larger than usual, and `times` those around it; None: not known."""
        if not 0 <= step < len(self.lengths) or np.isnan(self.lengths[step]):
            return None
        near = self.lengths[around][self.counted[around]]
        local = float(np.median(near)) if len(near) else 0.0
        return bool(self.lengths[step] > max(JUMP * self.usual, times * local))


def blank_frames(weights: FloatArray, posed: Sequence[int] | IntArray = ()) -> BoolArray:
    """Mask of frames without a face, (T,).

    Parameters
    ----------
    weights : array, shape (T, D)
        NaN: not observed.
    posed : sequence of int
        Frames that somebody posed: there is a face in these.
    """
    known = ~np.isnan(weights)
    low = np.where(known, weights, np.inf).min(axis=1)
    high = np.where(known, weights, -np.inf).max(axis=1)
    alike = (low == high) & (known.sum(axis=1) >= FEWEST)
    found = np.zeros_like(alike)
    if alike.mean() > MOST:
        return np.asarray(found)
    steps = _Steps.of(weights, alike)
    if not steps.usual:  # nothing moves, of which a jump would differ
        return np.asarray(found)
    for first, last in _stretches(np.where(alike, low, np.nan)):
        there = slice(first, last + 1)
        if not np.isin(posed, np.arange(len(weights))[there]).any():
            rare = _hardly_by_chance(weights, alike, low[first])
            found[there] = (
                steps.jump_beside(first, last) if rare else steps.jump_around(first, last)
            )
    return np.asarray(found)


def _hardly_by_chance(weights: FloatArray, alike: BoolArray, value: float) -> bool:
    """Whether all weights are hardly at a value by chance, as those of frames not alike are not."""
    others = weights[~alike]
    known = (~np.isnan(others)).sum(axis=0)
    shares = ((others == value).sum(axis=0) + 1.0) / (known + 2.0)
    return weights.shape[1] >= MANY and float(np.log(shares).sum()) < math.log(CHANCE)


def held_frames(weights: FloatArray) -> list[tuple[int, int]]:
    """First and last frames of stretches that repeat one frame and end with a jump."""
    nothing = np.asarray(np.isnan(weights).all(axis=1))
    largest = np.nan_to_num(np.abs(np.diff(weights, axis=0))).max(axis=1, initial=0.0)
    changes = (largest > 0.0) | (nothing[1:] != nothing[:-1])
    number = np.concatenate([[0], np.cumsum(changes)])
    held = (np.bincount(number) >= LASTING)[number] & ~nothing
    if held.mean() > MOST:
        return []
    steps = _Steps.of(weights, held)
    stretches = _stretches(np.where(held, number, np.nan))
    return [(first, last) for first, last in stretches if first > 0 and steps.jump_after(last)]


def _stretches(values: FloatArray) -> Iterator[tuple[int, int]]:
    """First and last indices of stretches of the same value (T,) that is not NaN."""
    starts = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))
    ends = np.append(starts[1:], len(values)) - 1
    for first, last in zip(starts.tolist(), ends.tolist(), strict=True):
        if not np.isnan(values[first]):
            yield first, last
