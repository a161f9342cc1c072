"""A take without noise and gaps, from itself alone."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray, frozen
from facert.data.normalisation import STILL, Normalisation
from facert.models.threads import threads_for
from facert.preprocess.cache import remembered
from facert.preprocess.motion.calibration import error_of_filling
from facert.preprocess.motion.motion import Motion
from facert.preprocess.motion.noise import capture_noise

log = logging.getLogger(__name__)

FEWEST = 10
"""Frames; in fewer there is no telling noise from motion."""
UNRELATED = 0.5
"""Frames whose differences from one to the next have this share of the variance that differences
of unrelated frames have do not follow each other."""
LEAST_NOISE = 1e-4
"""Least standard deviation of the noise, normalised units: half a micrometre of skin."""
ORDINARY = 0.9
"""This share of the steps from frame to frame is no gap."""
LONGEST = 60
"""Frames; after a longer gap in time a face may be anywhere, so none is taken to be longer."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Frames as they were, as far as can be told.

    Parameters
    ----------
    frames, spread : array, shape (T, d)
        Mean and standard deviation by the model of the motion; NaN in columns that were never
        observed.
    hidden : array of bool, shape (T, d)
        What was not observed.
    sigma : float
        Standard deviation of the capture noise.
    sigma_t : float
        How far the column that moves most goes from frame to frame, RMS.
    motion : Motion
        How the observed columns move, in `units`.
    units : Normalisation
        Of the observed columns.
    given : array, shape (T', d')
        The observed columns in these units, evenly spaced in time, that the estimate is of.
    """

    frames: FloatArray
    spread: FloatArray
    hidden: BoolArray
    sigma: float
    sigma_t: float
    motion: Motion
    units: Normalisation
    given: FloatArray

    def __post_init__(self) -> None:
        for array in (self.frames, self.spread, self.hidden, self.given):
            frozen(array)  # it is remembered: what one caller changed would come to all

    @cached_property
    def std(self) -> FloatArray:
        """Standard deviation, (T, d); of what was hidden, as the take's gaps tell that it is."""
        if not self.hidden.any():
            return self.spread
        noise = max(self.sigma / self.units.scale, LEAST_NOISE)
        with threads_for(1):
            ratio = error_of_filling(self.given, noise, float(self.motion.clock[0]))
        return frozen(np.where(self.hidden, ratio * self.spread, self.spread))

    def summary(self, unit: str) -> str:
        """Noise and motion, for people."""
        unit = f" {unit}" if unit else ""
        return f"capture noise {self.sigma:.2g}{unit}, motion {self.sigma_t:.2g}{unit} a frame"


@remembered
def estimate(X: FloatArray, time: FloatArray, sigma: float | None = None) -> Estimate:
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
    places, step = grid(time)
    even = np.full((places[-1] + 1, X.shape[1]), np.nan)
    even[places] = X
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
    return Estimate(frames, spread, np.isnan(X), sigma, step, motion, units, given)


def estimate_if_it_moves(
    X: FloatArray, time: FloatArray, sigma: float | None = None
) -> Estimate | None:
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

    Of the column where it is least: others may be noise alone.
    """
    steps, variance = np.diff(X, axis=0), np.nanvar(X, axis=0)
    known = (variance > 0.0) & ~np.isnan(steps).all(axis=0)
    relations = np.nanmean(steps[:, known] ** 2, axis=0) / (2.0 * variance[known])
    return float(relations.min(initial=np.inf))


def largest_step(X: FloatArray, sigma: float = 0.0) -> float:
    """RMS step from frame to frame of the column that moves most, less what is noise.

    Parameters
    ----------
    X : array, shape (T, d)
        NaN: not observed.
    sigma : float
        Standard deviation of the capture noise.
    """
    squares = np.diff(X, axis=0) ** 2
    known = ~np.isnan(squares)
    means = np.where(known, squares, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return float(np.sqrt(max(means.max(initial=0.0) - 2.0 * sigma**2, sigma**2)))


def grid(time: FloatArray) -> tuple[IntArray, float]:
    """Places (T,) of frames on an even grid, and its step in seconds: a typical one.

    Parameters
    ----------
    time : array, shape (T,)
        Seconds, rising. Gaps longer than `LONGEST` frames are cut short.
    """
    steps = np.diff(time)
    if not len(steps):
        return np.zeros(1, dtype=np.int64), 1.0
    # Not the median: packets may come in bursts.
    step = float(np.sort(steps)[: max(int(ORDINARY * len(steps)), 1)].mean())
    passed = np.clip(np.round(steps / step), 1, LONGEST)
    return np.concatenate([[0], np.cumsum(passed)]).astype(np.int64), step
