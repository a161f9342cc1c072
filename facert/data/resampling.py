"""Frame rates: that of a recording, and a take at another one.

A take is resampled by time: its values at new times, not its rows counted anew. Between two
frames that follow each other values go linearly. What was not observed stays so: a new frame
between an observed and a hidden one hides it too, and where the recording paused there are no new
frames.
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.take import Source, Take
from facert.data.text import plural
from facert.data.timecode import recounted
from facert.errors import InputError

log = logging.getLogger("facert")

PAUSE = 1.5
"""A step in time longer than so many nominal frames is a pause of the recording."""
MAX_FRAMES = 2**22
ONE_FRAME = 30.0
"""The nominal rate of a single frame."""

_SAME = 1e-6  # seconds: closer than this, a new frame is the old one
_SLACK = 1e-4  # of a frame, by which the last one may lie beyond the recording


def resampled(take: Take, fps: float) -> Take:
    """The take at evenly spaced times, from its first frame on.

    A pose between frames without one goes to the new frame that is nearest to it, half a frame away
    at most; the log has how far poses moved, and those that found no frame. The start timecode
    counts its frames at the new rate. Times stay where they have this rate, without pauses,
    already.

    Raises `InputError` when `fps` is not positive, or there would be more than `MAX_FRAMES` frames.
    """
    if not (np.isfinite(fps) and fps > 0):
        raise InputError("--fps", "a positive number", f"{fps}", "Give the rate of the output.")
    steps = np.diff(take.time)
    if np.abs(steps - 1 / fps).max(initial=0.0) <= _SAME:
        return replace(take, fps=fps)
    time = _new_times(take, fps)
    params, std = _poses_at(time, take, fps)
    return replace(
        take,
        time=time,
        source=_source_at(time, take),
        params=params,
        std=std,
        fps=fps,
        start_timecode=recounted(take.start_timecode, take.fps, fps),
    )


def nominal_rate(time: FloatArray) -> float:
    """Frames a second by the usual spacing of the frames; whole where that is within 1 %.

    `ONE_FRAME` for times (T,) that do not rise, or a single frame; gaps do not count.
    """
    if time.ndim != 1 or len(time) < 2 or not (time[1:] > time[:-1]).all():
        return ONE_FRAME
    rate = 1.0 / float(np.median(np.diff(time)))
    whole = float(np.rint(rate))
    return whole if abs(rate - whole) <= 0.01 * rate else rate


def _new_times(take: Take, fps: float) -> FloatArray:
    """Times of the new frames, (n,): those that lie in no pause."""
    first, last = take.time[0], take.time[-1]
    count = np.floor((last - first) * fps + _SLACK) + 1
    if count > MAX_FRAMES:
        raise InputError("--fps", f"at most {MAX_FRAMES} frames", f"{count:g}", "Lower the rate.")
    time = np.minimum(first + np.arange(int(count)) / fps, last)
    before, after = _neighbours(time, take.time)
    paused = take.time[after] - take.time[before] > PAUSE / take.fps
    return np.asarray(time[~paused])


def nearest_frames(time: FloatArray, wanted: FloatArray) -> IntArray:
    """Index of the rising times, (T,), that is nearest to each wanted one, (n,)."""
    after = np.clip(np.searchsorted(time, wanted), 0, len(time) - 1)
    before = np.maximum(after - 1, 0)
    closer = np.abs(time[before] - wanted) <= np.abs(time[after] - wanted)
    return np.where(closer, before, after).astype(np.int64)


def _neighbours(time: FloatArray, old: FloatArray) -> tuple[IntArray, IntArray]:
    """The old frames at or before, and at or after, each new time; the same one where they meet."""
    nearest = nearest_frames(old, time)
    met = np.abs(old[nearest] - time) <= _SAME
    after = np.clip(np.searchsorted(old, time, side="right"), min(1, len(old) - 1), len(old) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(met, nearest, before), np.where(met, nearest, after)


def _source_at(time: FloatArray, take: Take) -> Source:
    std = take.source.std
    spread = None if std is None else _at(time, take.time, std.reshape(len(std), -1))
    return take.source.with_matrix(_at(time, take.time, take.source.matrix), spread)


def _at(time: FloatArray, old: FloatArray, values: FloatArray) -> FloatArray:
    """Rows of values (T, D) at new times, (n, D); NaN where a neighbour is NaN."""
    before, after = _neighbours(time, old)
    span = np.where(before == after, 1.0, old[after] - old[before])
    share = np.where(before == after, 0.0, (time - old[before]) / span)[:, None]
    mixed = (1 - share) * values[before] + share * values[after]
    return np.where(before[:, None] == after[:, None], values[before], mixed)


def _poses_at(
    time: FloatArray, take: Take, fps: float
) -> tuple[FloatArray | None, FloatArray | None]:
    """Poses and their deviations at new times; a pose that stands alone goes to the nearest."""
    if take.params is None:
        return None, None
    places, alone = _single_poses(time, take, fps)
    params, std = (
        None if values is None else _at(time, take.time, values)
        for values in (take.params, take.std)
    )
    if params is not None:
        params[places] = take.params[alone]
    if std is not None and take.std is not None:
        std[places] = take.std[alone]
    return params, std


def _single_poses(time: FloatArray, take: Take, fps: float) -> tuple[IntArray, IntArray]:
    """New frames that get the pose of an old one as it is, and those old ones.

    These are the old poses that no new frame between two poses shows.
    """
    known = np.zeros(len(take), dtype=np.bool_)
    known[take.labels] = True
    before, after = _neighbours(time, take.time)
    between = known[before] & known[after]
    alone = np.setdiff1d(take.labels, np.append(before[between], after[between]))
    nearest = nearest_frames(time, take.time[alone])
    shifts = np.abs(time[nearest] - take.time[alone])
    order = np.argsort(shifts, kind="stable")  # of two for one frame, the nearer one
    places, first = np.unique(nearest[order], return_index=True)
    chosen = order[first]
    good = ~between[places] & (shifts[chosen] <= 0.5 / fps + _SAME)
    _log_moves(shifts[chosen[good]], len(alone) - int(good.sum()))
    return places[good], alone[chosen[good]]


def _log_moves(shifts: FloatArray, lost: int) -> None:
    moved = shifts[shifts > _SAME]
    if len(moved):
        poses, most = plural(len(moved), "pose"), 1e3 * moved.max()
        log.warning("%s moved by up to %.0f ms to the nearest frame", poses, most)
    if lost:
        log.warning("left out %s without a free frame near by", plural(lost, "pose"))
