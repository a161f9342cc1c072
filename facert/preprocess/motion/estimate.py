"""A take without noise and gaps, by its own motion, and how sure that is.

What the motion predicts of hidden entries is more certain than it should be: where a region is
hidden, what would have shown its own motion is hidden as well. So their standard deviation is
calibrated: the gaps of the take are hidden once more half a take later, where the same columns were
seen, and a motion learned without these is compared with what was seen.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, frozen
from facert.data.blocks import blocks
from facert.data.blocks import spread as evenly_spread
from facert.data.normalisation import STILL, Normalisation, deviation
from facert.models.threads import threads_for
from facert.preprocess.cache import keep_last
from facert.preprocess.motion.motion import Motion
from facert.preprocess.motion.series import capture_noise, even_grid, largest_step

log = logging.getLogger(__name__)

FEWEST = 10
"""Frames; in fewer, noise and motion cannot be separated."""
UNRELATED = 0.5
"""Frames whose differences from one to the next have this share of the variance that differences
of unrelated frames have do not follow each other."""
LEAST_NOISE = 1e-4
"""Least standard deviation of the noise, normalised units: half a micrometre of skin."""
LEAST_COMPARED, WINDOW = 100, 1000
"""Numbers that are compared to calibrate the standard deviation of hidden entries, at least, and
frames that they are taken from, at most."""
COLUMNS = 1200
"""Of more columns, so many are looked at."""
RANGE = (1.0, 10.0)
"""Of the calibration: a take that happens to have been easy half a take later proves nothing."""


@dataclass(frozen=True, eq=False)
class MotionEstimate:
    """Frames without noise and gaps."""

    # (T, d): Mean and standard deviation by the model of the motion; NaN in columns that were
    # never observed
    frames: FloatArray
    spread: FloatArray
    hidden: BoolArray  # (T, d): What was not observed
    sigma: float  # Standard deviation of the capture noise
    sigma_t: float  # How far the column that moves most goes from frame to frame, RMS
    motion: Motion  # How the observed columns move, in `units`
    units: Normalisation  # Of the observed columns
    # (T', d'): The observed columns in these units, evenly spaced in time, that the estimate is of
    given: FloatArray

    def __post_init__(self) -> None:
        for array in (self.frames, self.spread, self.hidden, self.given):
            frozen(array)  # cached: what one caller changed would come to all

    @cached_property
    def std(self) -> FloatArray:
        """Standard deviation, (T, d); calibrated where entries were hidden."""
        if not self.hidden.any():
            return self.spread
        noise = max(self.sigma / self.units.scale, LEAST_NOISE)
        with threads_for(1):
            ratio = error_of_filling(self.given, noise, float(self.motion.clock[0]))
        std = self.spread.copy()
        return frozen(np.multiply(std, ratio, out=std, where=self.hidden))

    def summary(self, unit: str) -> str:
        """Noise and motion, for people."""
        unit = f" {unit}" if unit else ""
        return f"capture noise {self.sigma:.2g}{unit}, motion {self.sigma_t:.2g}{unit} per frame"


@keep_last
def estimate(X: FloatArray, time: FloatArray, sigma: float | None = None) -> MotionEstimate:
    """The joint estimate of all frames, see `facert.preprocess.motion.motion`.

    Parameters
    ----------
    X : array, shape (T, d)
        Frames; NaN: not observed.
    time : array, shape (T,)
        Seconds, rising. What is longer than a typical step is a gap that hides frames.
    sigma : float, optional
        Standard deviation of the capture noise; from the frames by default.

    Raises
    ------
    InputError
        When nothing moves.
    """
    even, places, step = evenly(X, time)
    sigma = capture_noise(even) if sigma is None else sigma
    hidden = np.isnan(X)
    ever = _all_or(np.asarray(~hidden.all(axis=0)))
    units = Normalisation.of(X[:, ever], "/source")
    noise = max(sigma / units.scale, LEAST_NOISE)
    given = units.apply(even[:, ever])
    with threads_for(1):
        motion = Motion.learned(given, noise, step)
        smooth = motion.smooth(given, noise)
    mean, variance = smooth if len(even) == len(X) else (one[places] for one in smooth)
    for values in (mean, np.sqrt(variance, out=variance)):
        values *= units.scale
    mean += units.mean
    frames, spread = (_at_all(values, ever, X.shape) for values in (mean, variance))
    step = largest_step(frames)
    return MotionEstimate(frames, spread, hidden, sigma, step, motion, units, given)


def _all_or(mask: BoolArray) -> slice | IntArray:
    """The columns of a mask (d,); without a copy, where these are all."""
    return slice(None) if mask.all() else np.flatnonzero(mask)


def _at_all(values: FloatArray, ever: slice | IntArray, shape: tuple[int, ...]) -> FloatArray:
    """Values of the columns that were ever seen, and NaN in the others."""
    if isinstance(ever, slice):
        return values
    result = np.full(shape, np.nan)
    result[:, ever] = values
    return result


def evenly(X: FloatArray, time: FloatArray) -> tuple[FloatArray, IntArray, float]:
    """Frames (T, d) on an even grid, NaN where it has none; their rows in it; its step, seconds."""
    places, step = even_grid(time)
    if places[-1] + 1 == len(X):
        return X, places, step
    even = np.full((places[-1] + 1, X.shape[1]), np.nan)
    even[places] = X
    return even, places, step


def estimate_if_it_moves(
    X: FloatArray, time: FloatArray, sigma: float | None = None
) -> MotionEstimate | None:
    """The joint estimate of a performance; None for single poses, or a face that never moves."""
    if len(X) < FEWEST or not _moves(X):
        return None
    if sigma is None and not _follow(X):
        log.warning("the frames do not follow each other smoothly: each is taken on its own")
        return None
    return estimate(X, time, sigma)


def _moves(X: FloatArray) -> bool:
    """Whether a column of frames (T, d) varies by more than rounding."""
    largest = max(float(np.fmax.reduce(X, None)), -float(np.fmin.reduce(X, None)))
    return any((deviation(part) > STILL * largest).any() for part in _parts(X))


def _follow(X: FloatArray) -> bool:
    """Whether the frames of any column follow each other: others may be noise alone."""
    return any(_relation(part) <= UNRELATED for part in _parts(X))


def _parts(X: FloatArray) -> Iterator[FloatArray]:
    """Frames (T, d) in blocks of their columns, without those that never were observed."""
    for columns in blocks(X.shape[1], len(X)):
        part = X[:, columns]
        ever = _all_or(np.asarray(~np.isnan(part).all(axis=0)))
        yield part[:, ever]


def _relation(X: FloatArray) -> float:
    """Variance of the difference between neighbouring frames, relative to that of unrelated ones.

    The least of all columns is taken.
    """
    steps, variance = np.diff(X, axis=0), np.nanvar(X, axis=0)
    known = (variance > 0.0) & ~np.isnan(steps).all(axis=0)
    relations = np.nanmean(steps[:, known] ** 2, axis=0) / (2.0 * variance[known])
    return float(relations.min(initial=np.inf))


def error_of_filling(X: FloatArray, sigma: float, seconds: float) -> float:
    """Root mean square error at hidden entries, relative to their predicted standard deviation.

    Parameters
    ----------
    X : array, shape (T, d)
        Normalised frames, evenly spaced in time; NaN: not observed. Every column was seen.
    sigma : float
        Standard deviation of the capture noise.
    seconds : float
        From frame to frame.

    Returns
    -------
    float
        Within `RANGE`; 1 where the take has too few gaps.
    """
    looked_at = _compared(np.asarray(np.isnan(X).any(axis=0)))
    X = X[:, looked_at]
    hidden = np.isnan(X)
    again = np.roll(hidden, len(X) // 2, axis=0) & ~hidden
    again[:, (hidden | again).all(axis=0)] = False
    window = _busiest(again)
    compared = again[window]
    if np.count_nonzero(compared) < LEAST_COMPARED:
        return 1.0
    given = np.where(again, np.nan, X)
    mean, variance = Motion.learned(given, sigma, seconds).smooth(given[window], sigma)
    square = float(np.mean((mean - X[window])[compared] ** 2)) - sigma**2
    predicted = float(np.mean(variance[compared]))
    return float(np.clip(np.sqrt(max(square, 0.0) / predicted), *RANGE))


def _compared(gappy: BoolArray) -> slice | IntArray:
    """Columns that a calibration of many looks at: as many with gaps (d,) as without."""
    if len(gappy) <= COLUMNS:
        return slice(None)
    both = (np.flatnonzero(gappy), np.flatnonzero(~gappy))
    return np.sort(np.concatenate([one[evenly_spread(len(one), COLUMNS // 2)] for one in both]))


def _busiest(marked: BoolArray) -> slice:
    """The stretch of at most `WINDOW` frames (T, d) with most marks."""
    totals = np.concatenate([[0], np.cumsum(marked.sum(axis=1))])
    length = min(WINDOW, len(marked))
    start = int(np.argmax(totals[length:] - totals[: len(totals) - length]))
    return slice(start, start + length)
