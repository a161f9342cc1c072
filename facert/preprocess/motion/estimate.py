"""A take without noise and gaps, by its own motion, and how sure that is.

What the motion predicts of hidden entries is more certain than it should be: where a region is
hidden, what would have shown its own motion is hidden as well. So their standard deviation is
calibrated: the gaps of the take are hidden once more half a take later, where the same columns were
seen, and a motion learned without these is compared with what was seen.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, frozen
from facert.data.normalisation import STILL, Normalisation
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
        return frozen(np.where(self.hidden, ratio * self.spread, self.spread))

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
    ever = ~np.isnan(X).all(axis=0)
    units = Normalisation.of(X[:, ever], "/source")
    noise = max(sigma / units.scale, LEAST_NOISE)
    given = units.apply(even[:, ever])
    with threads_for(1):
        motion = Motion.learned(given, noise, step)
        mean, variance = motion.smooth(given, noise)
    frames, spread = np.full(X.shape, np.nan), np.full(X.shape, np.nan)
    frames[:, ever] = units.undo(mean[places])
    spread[:, ever] = units.scale * np.sqrt(variance[places])
    step = largest_step(frames)
    return MotionEstimate(frames, spread, np.isnan(X), sigma, step, motion, units, given)


def evenly(X: FloatArray, time: FloatArray) -> tuple[FloatArray, IntArray, float]:
    """Frames (T, d) on an even grid, NaN where it has none; their rows in it; its step, seconds."""
    places, step = even_grid(time)
    even = np.full((places[-1] + 1, X.shape[1]), np.nan)
    even[places] = X
    return even, places, step


def estimate_if_it_moves(
    X: FloatArray, time: FloatArray, sigma: float | None = None
) -> MotionEstimate | None:
    """The joint estimate of a performance; None for single poses, or a face that never moves."""
    seen = X[:, ~np.isnan(X).all(axis=0)]
    spread = float(np.nanstd(seen, axis=0).max())
    if len(X) < FEWEST or not spread > STILL * float(np.nanmax(np.abs(seen))):
        return None
    if sigma is None and _relation(seen) > UNRELATED:
        log.warning("the frames do not follow each other smoothly: each is taken on its own")
        return None
    return estimate(X, time, sigma)


def _relation(X: FloatArray) -> float:
    """Variance of the difference between neighbouring frames, relative to that of unrelated ones.

    The least of all columns is taken: others may be noise alone.
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


def _busiest(marked: BoolArray) -> slice:
    """The stretch of at most `WINDOW` frames (T, d) with most marks."""
    totals = np.concatenate([[0], np.cumsum(marked.sum(axis=1))])
    length = min(WINDOW, len(marked))
    start = int(np.argmax(totals[length:] - totals[: len(totals) - length]))
    return slice(start, start + length)
