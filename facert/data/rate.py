"""Frame rates: the nominal one of a recording, the broken ones of television, rows on a grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray

ONE_FRAME = 30.0
"""The nominal rate of a single frame."""

BROKEN = tuple(1000.0 * whole / 1001.0 for whole in (24, 30, 48, 60, 72, 120, 240))
"""The rates of television in America and Japan: 23.976, 29.97, 47.952, 59.94 and so on."""

AGREES = 0.01
"""Rates agree within this share."""

_USUAL = (10.0, 12.0, 15.0, 20.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0, 240.0)
_LONGEST = 2.0**31  # frames of a gap
_MOST = 2.0**53  # frames
_FITS = 2e-4  # the share by which clocks go wrong
_SHORTEST = 1e-9  # seconds between frames


@dataclass(frozen=True, eq=False)
class _Fit:
    """An even spacing of rows where they follow each other."""

    step: float  # seconds
    error: float  # of the step, a standard deviation


def standard_rate(fps: float) -> float:
    """The rate that a number stands for: 29.97 is 30000/1001.

    >>> standard_rate(29.97) == 30000 / 1001, standard_rate(23.98) == 24000 / 1001
    (True, True)
    >>> standard_rate(29.9), standard_rate(30)
    (29.9, 30.0)
    """
    near = (rate for rate in BROKEN if abs(fps - rate) < 6e-4 or fps == round(rate, 2))
    return next(near, float(fps))


def whole_count(fps: float) -> int:
    """How many frames a timecode counts in a second: the next whole number, 30 for 29.97."""
    return max(1, round(fps))


def nominal_rate(time: FloatArray) -> float:
    """Frames a second by the usual spacing of the frames.

    It is whole where that is within 1 %; or 29.97 and the like, where the recording is long enough
    to distinguish that from 30. `ONE_FRAME` for times (T,) that do not rise, or a single frame;
    gaps do not count.
    """
    if not _rises(time):
        return ONE_FRAME
    fit = _fitted(time)
    shown, median = 1.0 / fit.step, 1.0 / float(np.median(np.diff(time)))
    unsure = 4 * fit.error / fit.step + resolution(time) / float(time[-1] - time[0])
    usual = min(_USUAL, key=lambda rate: abs(rate - shown))
    if unsure > AGREES and abs(usual - shown) <= unsure * shown:
        return usual
    for rate in (shown, median):
        if abs(rate - np.rint(rate)) <= AGREES * rate:
            return _broken_or_whole(shown, float(np.rint(rate)), unsure)
    return shown


def rate_shown(time: FloatArray) -> float:
    """Frames a second by the slope of the times (T,), which rise, as exactly as they show it."""
    return 1.0 / _fitted(time).step if _rises(time) else ONE_FRAME


def frames_shown(time: FloatArray) -> IntArray | None:
    """Numbers of the frames, (T,), from 0, at the rate that the times show; None if uneven.

    Rows may be missing, and times be rounded.
    """
    if not _rises(time):
        return None
    fit = _fitted(time)
    return frames_at(time, 1.0 / fit.step, 0.1)


def frames_at(time: FloatArray, fps: float, slack: float) -> IntArray | None:
    """Numbers of the frames, (T,), from 0, of times that lie on a grid of so many a second.

    `slack` is how far from it they may lie, in frames, besides the rounding of the times. None
    where one lies farther, or two share a place.
    """
    after = (time - time[0]) * fps
    offset = float(np.median(after - np.rint(after)))
    frames = np.rint(after - offset)
    reach = min(slack + 0.5 * fps * resolution(time), 0.45)
    on_grid = np.abs(after - offset - frames).max() <= reach
    if not on_grid or (np.diff(frames) < 1).any() or frames[-1] - frames[0] > _MOST:
        return None
    return np.asarray(frames - frames[0], dtype=np.int64)


def resolution(time: FloatArray) -> float:
    """Seconds to which times, (T,), were rounded: 1 to 0.001, or a sixtieth; 0 where none shows.

    Frames that lie exactly evenly were not rounded.
    """
    taken = np.diff(time) / np.median(np.diff(time)) if len(time) > 1 else np.ones(1)
    if np.abs(taken - np.rint(taken)).max() <= 1e-4:
        return 0.0
    for unit in (1.0, 0.1, 0.01, 1 / 60, 0.001):
        counted = time / unit
        if np.abs(counted - np.rint(counted)).max() <= 1e-4:
            return unit
    return 0.0


def _rises(time: FloatArray) -> bool:
    if time.ndim != 1 or len(time) < 2 or not np.isfinite(time[[0, -1]]).all():
        return False
    steps = np.diff(time)
    return bool((steps > 0).all() and np.quantile(steps, 0.5, method="lower") > _SHORTEST)


def _fitted(time: FloatArray) -> _Fit:
    """Fit of an even spacing to times, with rows missing; each run of rows has its own start."""
    steps = np.diff(time)
    median = float(np.quantile(steps, 0.5, method="lower"))
    usual = float(np.mean(steps[(steps >= 0.49 * median) & (steps <= 1.6 * median)]))
    with np.errstate(over="ignore"):
        ratios = steps / usual
    taken = np.where(ratios < 1.6, 1.0, np.rint(np.minimum(ratios, _LONGEST)))
    clean = np.abs(ratios - taken) <= np.where(taken == 1, 0.6, 0.15)
    frames = np.append(0, np.cumsum(taken))
    run = np.append(0, np.cumsum(~clean))
    x, y = _centred(frames, run), _centred(time, run)
    moment = float(x @ x)
    if not moment:
        return _Fit(usual, usual)
    step = float(x @ y) / moment
    free = max(len(time) - int(run[-1]) - 2, 1)
    error = float(np.sqrt(np.sum((y - step * x) ** 2) / free / moment))
    return _Fit(step, error)


def _centred(values: FloatArray, run: IntArray) -> FloatArray:
    """Values without the mean of their run."""
    counts = np.bincount(run)
    return np.asarray(values - (np.bincount(run, values) / counts)[run])


def _broken_or_whole(shown: float, whole: float, unsure: float) -> float:
    """A whole rate, or the broken one below it where the times distinguish the two."""
    broken = 1000.0 * whole / 1001.0
    if broken not in BROKEN:
        return whole
    nearer = abs(shown - broken) < abs(shown - whole)
    told_apart = abs(shown - whole) > unsure * whole
    fits = abs(shown - broken) <= (_FITS + unsure) * broken
    return broken if nearer and told_apart and fits else whole
