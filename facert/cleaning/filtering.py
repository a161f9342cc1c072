"""Noise out of a live source, gaps filled, frame by frame: the causal side of `motion`.

A Kalman filter for the factors, and one for what they leave over of each column. Live, the face may
do what the training take did not show. The factors leave it over, more than they should; then what
is left over is taken to vary more, until it no longer surprises (as adaptive filters do, Mehra
1970), and new motion passes.

How sure the filter is of the factors depends on what was observed and not on where: as long as
frames show the same markers, the gain settles and need not be computed again.
"""

from __future__ import annotations

import numpy as np

from facert.cleaning.factors import Factors
from facert.cleaning.matern import transition
from facert.cleaning.motion import LEAST_VARIANCE, Motion
from facert.cleaning.noise import capture_noise
from facert.cleaning.smoothing import forward_covariance
from facert.data import BoolArray, FloatArray

LEAST_REST = 1e-2
"""Least variance of what is left over of a column, relative to that of the noise."""
MEMORY = 0.9
"""Weight of the frames before when surprise is measured."""
RISE, FALL, MOST = 4.0, 0.8, 1e6
"""How much wider in a frame what is left over may be taken to vary, how much narrower, and how much
wider at all than in training."""
FAR, GROSS = 6.0, 1.0
"""A number so many standard deviations off, and so many normalised units, is not believed for a
frame: nothing moves so far so quickly, but bad markers do."""
HEARD = 120
"""Frames that noise is measured in."""
SETTLED = 1e-4
"""Relative change of the covariance in a frame below which it is taken to have settled."""


class MotionFilter:
    """Cleans one frame after the other.

    Parameters
    ----------
    motion : Motion
        Learned from a take of the same actor.
    sigma : float
        Standard deviation of the capture noise, normalised units.
    """

    def __init__(self, motion: Motion, sigma: float) -> None:
        self._motion = motion
        self._shared = _FactorFilter(motion.seen_with(sigma), motion.rates)
        rest = np.maximum(motion.rest, max(LEAST_REST * sigma**2, LEAST_VARIANCE))
        self._rest = _SeriesFilter(rest, motion.rest_rates, sigma**2)
        self._begun = False
        self._was_off: BoolArray = np.zeros(len(rest), dtype=np.bool_)

    def hear(self, sigma: float) -> None:
        """Go on with another noise."""
        self._shared.hear(self._motion.seen_with(sigma))
        self._rest.noise = sigma**2

    def step(self, frame: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (d,) of one more normalised frame (d,); NaN: not observed."""
        seen = ~np.isnan(frame) & ~self._spikes(frame)
        mean, variance = self._shared.step(frame, seen)
        rest, doubt = self._rest.step(np.where(seen, frame - mean, 0.0), seen)
        self._begun = True
        return mean + rest, variance + doubt

    def _spikes(self, frame: FloatArray) -> BoolArray:
        """What is far off for the first time; the second time, it is there."""
        if not self._begun:
            return self._was_off
        shared, rest = self._shared, self._rest
        off = np.abs(frame - shared.expected - rest.expected)
        spread = np.sqrt(shared.variance + rest.foretold)
        is_off = np.asarray(off > np.maximum(FAR * spread, GROSS))  # never where NaN
        spikes, self._was_off = is_off & ~self._was_off, is_off
        return spikes


class _FactorFilter:
    """Of the factors z and their velocities, observed together, see `smoothing.smooth_factors`."""

    def __init__(self, factors: Factors, rates: FloatArray) -> None:
        self._factors = factors
        q = factors.count
        blocks = transition(rates)
        self._F = np.block([[np.diag(block) for block in row] for row in blocks])
        self._Q = np.eye(2 * q) - self._F @ self._F.T
        self._m, self._P = np.zeros(2 * q), np.eye(2 * q)
        self._seen: BoolArray = np.zeros(0, dtype=np.bool_)
        self._settled = False
        self.variance: FloatArray = np.zeros(len(factors.mean))

    def hear(self, factors: Factors) -> None:
        """Go on with another noise."""
        self._factors, self._settled = factors, False

    @property
    def expected(self) -> FloatArray:
        """The next frame, (d,), before it is seen."""
        return self._factors.frames((self._F @ self._m)[: self._factors.count])

    def step(self, frame: FloatArray, seen: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (d,) of what the factors make of a frame."""
        m = self._F @ self._m
        if not (self._settled and np.array_equal(seen, self._seen)):
            self._update(seen)
        factors, q = self._factors, self._factors.count
        residual = np.where(seen, frame - factors.frames(m[:q]), 0.0)
        self._m = m + self._gain @ residual
        return factors.frames(self._m[:q]), self.variance

    def _update(self, seen: BoolArray) -> None:
        """The gain, and the covariance after this frame."""
        factors, q = self._factors, self._factors.count
        trusted = factors.weights * (seen / factors.noise)[:, None]
        precision = factors.weights.T @ trusted
        P = self._F @ self._P @ self._F.T + self._Q
        pulled = P[:, :q] @ np.linalg.inv(np.eye(q) + precision @ P[:q, :q])
        self._gain = pulled @ trusted.T
        after = P - pulled @ precision @ P[:q]
        after = (after + after.T) / 2.0
        change = np.abs(np.diag(after) - np.diag(self._P)).max()
        self._settled = bool(change < SETTLED * np.diag(after).min())
        self._P, self._seen = after, seen
        self.variance = factors.variance(after[None, :q, :q])[0]


class _SeriesFilter:
    """Of independent series with their velocities, see `smoothing.smooth_series`; adaptive."""

    def __init__(self, variance: FloatArray, rates: FloatArray, noise: float) -> None:
        F = transition(rates)
        self._F, self.noise = F, noise
        self._forward = forward_covariance(F)
        prior = np.stack([variance, np.zeros_like(variance), variance])
        self._drift = prior - (self._forward * prior).sum(axis=1)
        self._m, self._P = np.zeros((2, len(variance))), prior
        self._width = np.ones_like(variance)
        self._found = self._foretold = variance + noise

    @property
    def expected(self) -> FloatArray:
        """The next values, (d,), before they are seen."""
        return np.asarray(self._F[0, 0] * self._m[0] + self._F[0, 1] * self._m[1])

    @property
    def foretold(self) -> FloatArray:
        """Their variance, with the noise, (d,)."""
        return np.asarray(self._ahead()[0] + self.noise)

    def step(self, values: FloatArray, seen: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (d,) after one more value of each."""
        m = self._F[:, 0] * self._m[0] + self._F[:, 1] * self._m[1]
        P = self._ahead()
        surprise = np.where(seen, values - m[0], 0.0)
        P = P * self._widened(surprise, P[0], seen)
        gain = P[:2] * (seen / (P[0] + self.noise))
        self._m = m + gain * surprise
        self._P = P - np.stack([gain[0] * P[0], gain[0] * P[1], gain[1] * P[1]])
        return self._m[0], self._P[0]

    def _ahead(self) -> FloatArray:
        """The covariance (3, d) of value and velocity in the next frame."""
        ahead: FloatArray = (self._forward * self._P).sum(axis=1) + self._width * self._drift
        return ahead

    def _widened(self, surprise: FloatArray, variance: FloatArray, seen: BoolArray) -> FloatArray:
        """How much wider than so far each is taken to vary, after this surprise."""
        fresh = (1.0 - MEMORY) * seen
        self._found = self._found + fresh * (surprise**2 - self._found)
        self._foretold = self._foretold + fresh * (variance + self.noise - self._foretold)
        ratio = (self._found - self.noise) / (self._foretold - self.noise)
        before = self._width
        change = np.where(seen, np.clip(ratio, FALL, RISE), 1.0)
        self._width = np.clip(before * change, 1.0, MOST)
        return self._width / before


class NoiseMeter:
    """Measures the noise of a live source now and then."""

    def __init__(self, columns: int) -> None:
        self._frames = np.full((HEARD, columns), np.nan)
        self._count = 0

    def step(self, frame: FloatArray) -> float | None:
        """The standard deviation of the noise in the last frames, when it is time to tell."""
        self._frames[self._count % HEARD] = frame
        self._count += 1
        if self._count % HEARD or not np.isfinite(self._frames).any():
            return None
        return capture_noise(self._frames)
