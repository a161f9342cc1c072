"""A take at another frame rate, at even times, or counted anew.

A take is resampled by time: its values at new times, not its rows counted anew. Between two
frames that follow each other values go linearly. What was not observed stays so: a new frame
between an observed and a hidden one hides it too, and where the recording paused, or frames are
missing, nothing is observed in the new ones.
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.corrections import at_frames, put_in, taken_out
from facert.data.memory import FLOAT, require_memory
from facert.data.rate import AGREES, frames_at, frames_shown, rate_shown, standard_rate
from facert.data.take import Source, Take
from facert.data.text import listed, plural
from facert.data.timecode import recounted
from facert.errors import InputError

log = logging.getLogger("facert")

PAUSE = 1.5
"""A step in time longer than so many nominal frames is a pause of the recording."""
LONGEST = 3600.0
"""Seconds of a pause, at most, that is played as it is: a longer one is of a clock that was set, or
of two takes in one."""
MAX_FRAMES = 2**22
EVEN = 0.1
"""Frames lie evenly when each is off by so much of a frame at most, besides rounding."""

_COPIES = 3  # of the largest part of a take, as it is interpolated
_SAME = 1e-6  # seconds: closer than this, a new frame is the old one
_SLACK = 1e-4  # of a frame, by which the last one may lie beyond the recording
_AT_PAUSE = 0.25  # of a frame: beside a pause, a new frame is an old one as near as this


def resampled(take: Take, fps: float) -> Take:
    """The take at evenly spaced times, from its first frame on: every frame of the new rate.

    In a pause of the recording nothing is observed. A pose between frames without one goes to the
    new frame that is nearest to it, half a frame away at most, and in no pause; the log has how far
    poses moved, and those that found no frame. The start timecode counts its frames at the new
    rate. Where frames lie at these times already, up to rounding, their values stay as they are.

    Raises `InputError` when `fps` is not positive, or there would be more than `MAX_FRAMES` frames.
    """
    if not (np.isfinite(fps) and fps > 0):
        raise InputError("--fps", "a positive number", f"{fps}", "Give the rate of the output.")
    start = recounted(take.start_timecode, take.fps, fps)
    agrees = abs(take.fps - fps) <= AGREES * fps
    places = frames_at(take.time, fps, _SAME * fps) if agrees else None
    return replace(_remade(take, places, fps), start_timecode=start)


def evenly_spaced(take: Take) -> Take:
    """The take as who plays a frame every 1/fps expects it, wherever its frames lie.

    Frames that lie evenly stay as they are, missing ones come between them with nothing observed;
    others are resampled, which the log has.

    Raises `InputError` where a pause is over `LONGEST`, or there would be more than `MAX_FRAMES`
    frames.
    """
    _check_pauses(take.time)
    places = frames_at(take.time, take.fps, EVEN)
    even = _remade(take, places, take.fps)
    if places is None:
        log.info("frames lie unevenly: resampled to %d at %.6g a second", len(even), take.fps)
    return even


def held(take: Take) -> Take:
    """The take with the frame before, or else the first, where nothing was observed of it.

    So it is done with the poses if there are any, else with the source weights. A frame without a
    pose beside others without one stays as it is: nobody posed them. The log has how many were
    held.
    """
    values = take.source.values if take.params is None else take.params
    if values.ndim == 3:
        return take
    known = np.asarray(~np.isnan(values).all(axis=1))
    lost = ~known & ~take.source.valid.any(axis=1)
    rows = np.arange(len(take))
    before = np.maximum.accumulate(np.where(lost, -1, rows))
    after = np.minimum.accumulate(np.where(lost, len(take), rows)[::-1])[::-1]
    left, right = np.maximum(before, 0), np.minimum(after, len(take) - 1)
    holds = lost & ((before < 0) | known[left]) & ((after == len(take)) | known[right])
    if not holds.any():
        return take
    frames = plural(int(holds.sum()), "missing frame")
    log.warning("%s: held as the frame before, as rows are played evenly", frames)
    whole = values[np.where(holds, np.where(before < 0, right, left), rows)]
    if take.params is None:
        return replace(take, source=replace(take.source, values=whole))
    return replace(take, params=whole)


def counted_at(take: Take, fps: float) -> Take:
    """The take as one of so many frames a second, whatever its times are: its frames counted anew.

    Missing frames stay missing. Where times are uneven but agree with the rate, they stay, too.

    Raises `InputError` when they are uneven and contradict it.
    """
    fps = standard_rate(fps)
    shown, frames = rate_shown(take.time), frames_shown(take.time)
    start = recounted(take.start_timecode, take.fps, fps)
    if len(take) > 1 and frames is None:
        if abs(shown - fps) > AGREES * fps:
            found, fix = f"{fps:.6g}", "Leave it out; --fps N resamples by time."
            expected = f"about {shown:.4g}, as the file's uneven times show"
            raise InputError("--in-fps", expected, found, fix)
        return replace(take, fps=fps, start_timecode=start)
    if frames is None or abs(shown - fps) <= 1e-6 * fps:
        return replace(take, fps=fps, start_timecode=start)
    log.info("the file's times show %.6g frames/s: counted at %.6g", shown, fps)
    time = (take.time[0] * shown + frames) / fps
    return replace(take, time=time, fps=fps, start_timecode=start, clock_start=0.0)


def _remade(take: Take, places: IntArray | None, fps: float) -> Take:
    """The take with its frames at these places of an even grid, else interpolated.

    Corrections go to the nearest new frames, and are blended anew with what was predicted.
    """
    bare = taken_out(take)
    made = _interpolated(bare, fps) if places is None else _placed(bare, places, fps)
    if take.corrections is None:
        return made
    frames = nearest_frames(made.time, take.time[take.corrections.frames])
    return put_in(made, at_frames(take.corrections, frames))


def _placed(take: Take, places: IntArray, fps: float) -> Take:
    """The take with its frames at these places of an even grid, the others unobserved.

    Times stay where no frame is missing: they may be more exact than the grid.
    """
    if len(take) == places[-1] + 1:
        return replace(take, fps=fps)
    count = int(places[-1]) + 1
    _check_count(count, take)

    def spread(rows: FloatArray | None) -> FloatArray | None:
        if rows is None:
            return None
        filled = np.full((count, *rows.shape[1:]), np.nan)
        filled[places] = rows
        return filled

    values = spread(take.source.values)
    assert values is not None
    source = replace(take.source, values=values, std=spread(take.source.std))
    time = take.time[0] + np.arange(count) / fps
    params, std = spread(take.params), spread(take.std)
    return replace(take, time=time, source=source, params=params, std=std, fps=fps)


def _interpolated(take: Take, fps: float) -> Take:
    time = _new_times(take, fps)
    params, std = _poses_at(time, take, fps)
    source = _source_at(time, take, fps)
    return replace(take, time=time, source=source, params=params, std=std, fps=fps)


def _new_times(take: Take, fps: float) -> FloatArray:
    """Times of the new frames, (n,)."""
    first, last = take.time[0], take.time[-1]
    count = np.floor((last - first) * fps + _SLACK) + 1
    _check_count(count, take)
    return np.asarray(np.minimum(first + np.arange(int(count)) / fps, last))


def _check_pauses(time: FloatArray) -> None:
    """Check that frames follow each other closely enough to be played row by row."""
    pauses = np.diff(time)
    if len(pauses) and pauses.max() > LONGEST:
        found = f"{pauses.max():.6g} s without frames after frame {pauses.argmax()}"
        fix = "Cut the recording there, or write .h5, which keeps the times."
        raise InputError("/time", f"pauses of at most {LONGEST:g} s", found, fix)


def _check_count(count: float, take: Take) -> None:
    """Check how many frames there will be, and what they will take, before any is made."""
    fix = "Lower the rate."
    if count > MAX_FRAMES:
        raise InputError("--fps", f"at most {MAX_FRAMES} frames", f"{count:g}", fix)
    widths = [0 if part is None else part[0].size for part in _parts(take)]
    size = FLOAT * int(count) * (sum(widths) + _COPIES * max(widths))
    require_memory(size, f"--fps ({count:g} frames)", fix)


def _parts(take: Take) -> tuple[FloatArray | None, ...]:
    """All that a take has of each frame."""
    return take.source.values, take.source.std, take.params, take.std


def nearest_frames(time: FloatArray, wanted: FloatArray) -> IntArray:
    """Index of the rising times, (T,), that is nearest to each wanted one, (n,)."""
    after = np.clip(np.searchsorted(time, wanted), 0, len(time) - 1)
    before = np.maximum(after - 1, 0)
    closer = np.abs(time[before] - wanted) <= np.abs(time[after] - wanted)
    return np.where(closer, before, after).astype(np.int64)


def _neighbours(time: FloatArray, take: Take, fps: float) -> tuple[IntArray, IntArray, BoolArray]:
    """The old frames at or before, and at or after, each new time, and which lie in a pause.

    The two are the same one where they meet, and beside a pause where they nearly do.
    """
    old = take.time
    nearest = nearest_frames(old, time)
    after = np.clip(np.searchsorted(old, time, side="right"), min(1, len(old) - 1), len(old) - 1)
    before = np.maximum(after - 1, 0)
    paused = old[after] - old[before] > PAUSE / take.fps
    met = np.abs(old[nearest] - time) <= np.where(paused, _AT_PAUSE / fps, _SAME)
    return np.where(met, nearest, before), np.where(met, nearest, after), paused & ~met


def _source_at(time: FloatArray, take: Take, fps: float) -> Source:
    std = take.source.std
    spread = None if std is None else _at(time, take, fps, std.reshape(len(std), -1))
    return take.source.with_matrix(_at(time, take, fps, take.source.matrix), spread)


def _at(time: FloatArray, take: Take, fps: float, values: FloatArray) -> FloatArray:
    """Rows of values (T, D) at new times, (n, D); NaN in a pause, and where a neighbour is NaN."""
    before, after, paused = _neighbours(time, take, fps)
    span = np.where(before == after, 1.0, take.time[after] - take.time[before])
    share = np.where(before == after, 0.0, (time - take.time[before]) / span)[:, None]
    mixed = (1 - share) * values[before] + share * values[after]
    mixed = np.where(before[:, None] == after[:, None], values[before], mixed)
    mixed[paused] = np.nan
    return mixed


def _poses_at(
    time: FloatArray, take: Take, fps: float
) -> tuple[FloatArray | None, FloatArray | None]:
    """Poses and their deviations at new times; a pose that stands alone goes to the nearest."""
    if take.params is None:
        return None, None
    places, alone = _single_poses(time, take, fps)
    params, std = (
        None if values is None else _at(time, take, fps, values)
        for values in (take.params, take.std)
    )
    if params is not None:
        params[places] = take.params[alone]
    if std is not None and take.std is not None:
        std[places] = take.std[alone]
    return params, std


def _single_poses(time: FloatArray, take: Take, fps: float) -> tuple[IntArray, IntArray]:
    """New frames that get the pose of an old one as it is, and those old ones.

    These are the old poses that no new frame between two poses shows, but for those amid others: of
    animation at a lower rate every pose need not be seen.
    """
    known = np.zeros(len(take), dtype=np.bool_)
    known[take.labels] = True
    before, after, paused = _neighbours(time, take, fps)
    between = known[before] & known[after] & ~paused
    shown = np.append(before[between], after[between])
    alone = np.setdiff1d(take.labels, np.append(shown, _amid_others(take, known)))
    nearest = nearest_frames(time, take.time[alone])
    shifts = np.abs(time[nearest] - take.time[alone])
    order = np.argsort(shifts, kind="stable")  # of two for one frame, the nearer one
    places, first = np.unique(nearest[order], return_index=True)
    chosen = order[first]
    good = ~between[places] & ~paused[places] & (shifts[chosen] <= 0.5 / fps + _SAME)
    _log_moves(shifts[chosen[good]], np.setdiff1d(alone, alone[chosen[good]]), take)
    return places[good], alone[chosen[good]]


def _amid_others(take: Take, known: BoolArray) -> IntArray:
    """The frames with a pose that have one right before and after them, by the mask of all (T,)."""
    joined = known[:-1] & known[1:] & (np.diff(take.time) <= PAUSE / take.fps)
    return np.flatnonzero(joined[:-1] & joined[1:]) + 1


def _log_moves(shifts: FloatArray, lost: IntArray, take: Take) -> None:
    moved = shifts[shifts > _SAME]
    if len(moved):
        poses, most = plural(len(moved), "pose"), 1e3 * moved.max()
        log.warning("%s moved by up to %.0f ms to the nearest frame", poses, most)
    if len(lost):
        frames = listed([f"{frame} ({take.time[frame]:.3f} s)" for frame in lost.tolist()])
        text = (
            "left out %s without a free frame near by (another pose or a pause is there): frame %s"
        )
        log.warning(text, plural(len(lost), "pose"), frames)
