"""Corrected poses in a result of retargeting, blended with the frames around them.

A correction moves its own frame t_i by d_i, from the predicted pose to the one that somebody set.
Frames around it are moved as well, the further off the less:

    y(t) = p(t) + Σ_i w_i(t) d_i,      w_i(t) = 1 - 3 r² + 2 r³,      r = |t - t_i| / h_i ≤ 1.

The window reaches h_i to either side, half of its width, but no further than to the next corrected
frame. So the weights are smooth, are 0 at other corrected frames, and sum to at most 1: every
corrected frame is met exactly, and two close by are joined by a smooth step. Controls keep to their
limits; one without limits goes no further than it went in the prediction or in a corrected pose.

Frames in a window keep the standard deviation of their prediction. Their error gets less with the
correction, but so much less in one recording and little in another, and where a model is wrong it
was too sure before (`experiments/correcting_shots.py`).
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.take import Corrections, Take
from facert.data.text import plural
from facert.errors import InputError

log = logging.getLogger("facert")

WIDTH = 0.5
"""Seconds from the beginning of a correction's window to its end, unless others are asked for."""


def put_in(result: Take, corrections: Corrections) -> Take:
    """The result with these corrections, and no others.

    Corrected frames have exactly their poses, and no standard deviation. The take keeps what it
    was without them, see `taken_out`.

    Parameters
    ----------
    result : Take
        Retargeted; corrections that it has are taken out first.
    corrections : Corrections
        In the order of the result's controls.

    Raises
    ------
    InputError
        When the result has no poses, or fewer frames or other controls than the corrections.
    """
    base = taken_out(result)
    if base.params is None or not len(base.labels):
        fix = "Retarget the recording first: facert retarget."
        raise InputError("/target/params", "the poses of a result", "none", fix)
    corrections.require_fit(base.params.shape)
    params = _blended(base, base.params, corrections)
    std = None
    if base.std is not None:
        std = base.std.copy()
        std[corrections.frames] = np.nan
    kept = replace(corrections, predicted=base.params, std=base.std)
    return replace(base, params=params, std=std, corrections=kept)


def taken_out(take: Take) -> Take:
    """The take as it was before corrections were put in; a take without any as it is."""
    corrections = take.corrections
    if corrections is None:
        return take
    return replace(take, params=corrections.predicted, std=corrections.std, corrections=None)


def merged(earlier: Corrections | None, later: Corrections) -> Corrections:
    """Both of them; where they correct the same frame, the later counts."""
    if earlier is None:
        return later
    kept = np.isin(earlier.frames, later.frames, invert=True)
    frames = np.concatenate([earlier.frames[kept], later.frames])
    order = np.argsort(frames)
    params = np.concatenate([earlier.params[kept], later.params])
    width = np.concatenate([earlier.width[kept], later.width])
    return Corrections(frames[order], params[order], width[order])


def at_frames(corrections: Corrections, frames: IntArray) -> Corrections:
    """Corrections at other frames (c,), not falling; of several for one frame the first counts."""
    frames, first = np.unique(frames, return_index=True)
    lost = len(corrections.frames) - len(frames)
    if lost:
        log.warning("%s left out: another is at the same frame", plural(lost, "correction"))
    return _some(corrections, first, frames)


def without(corrections: Corrections, frames: IntArray) -> Corrections | None:
    """Corrections but for those of some frames; None where nothing is left.

    Raises
    ------
    InputError
        When one of the frames is not corrected.
    """
    absent = np.setdiff1d(frames, corrections.frames)
    if len(absent):
        there = ", ".join(map(str, corrections.frames.tolist()))
        fix = "facert correct --list names them."
        raise InputError("corrected frames", f"one of {there}", f"{absent[0]}", fix)
    kept = np.flatnonzero(np.isin(corrections.frames, frames, invert=True))
    return _some(corrections, kept, corrections.frames[kept]) if len(kept) else None


def _some(corrections: Corrections, chosen: IntArray, frames: IntArray) -> Corrections:
    """Some of the corrections, at these frames."""
    return Corrections(frames, corrections.params[chosen], corrections.width[chosen])


def _blended(take: Take, predicted: FloatArray, corrections: Corrections) -> FloatArray:
    """Poses y(t) from predicted ones p(t), (T, P)."""
    frames, poses = corrections.frames, corrections.params
    d = np.nan_to_num(poses - predicted[frames])  # NaN: nothing was predicted
    moved = _weighted(take.time, corrections, d)
    low, high = _bounds(take, np.vstack([predicted, poses]))
    blended = np.where(moved == 0.0, predicted, np.clip(predicted + moved, low, high))
    blended[frames] = poses
    return blended


def _bounds(take: Take, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest value of each control, (P,): its limit, or else that of poses (n, P)."""
    low, high = np.nanmin(poses, axis=0), np.nanmax(poses, axis=0)
    if take.controls is None or take.controls.limits is None:
        return low, high
    lowest, highest = take.controls.limits.T
    low = np.where(np.isfinite(lowest), np.minimum(low, lowest), low)
    return low, np.where(np.isfinite(highest), np.maximum(high, highest), high)


def _weighted(time: FloatArray, corrections: Corrections, offsets: FloatArray) -> FloatArray:
    """Σ_i w_i(t) d_i at every time (T,), (T, P); only those before and after it reach a frame."""
    at, last = time[corrections.frames], len(corrections.frames) - 1
    after = np.searchsorted(at, time)
    gaps = np.concatenate([[np.inf], np.diff(at), [np.inf]])[after]
    moved = np.zeros((len(time), offsets.shape[1]))
    for which, there in ((after - 1, after > 0), (after, after <= last)):
        nearest = np.clip(which, 0, last)
        reach = np.minimum(corrections.width[nearest] / 2.0, gaps)
        distance = np.abs(time - at[nearest])
        within = there & (distance < reach)
        r = distance[within] / reach[within]
        moved[within] += (1.0 - 3.0 * r**2 + 2.0 * r**3)[:, None] * offsets[nearest[within]]
    return moved
