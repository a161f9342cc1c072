"""Noise out of a live source, gaps filled, frame by frame: the causal side of `motion`.

A Kalman filter for the factors, and one for what they leave over of each column. Live, the face may
do what the training take did not show. The factors leave more of it over than they should; then
the rest is taken to vary more, until it no longer surprises (an adaptive filter, Mehra 1970), and
new motion passes.

The covariance of the factors depends on which columns were observed and not on their values: as
long as frames show the same markers, the gain settles and need not be computed again. All that can
be computed before a frame comes is done by `look_ahead`, in the time between two frames.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.preprocess.motion.motion import LEAST_VARIANCE, Motion
from facert.preprocess.motion.motion_factors import MotionFactors
from facert.preprocess.motion.series import capture_noise
from facert.preprocess.motion.smoothing import (
    carried,
    factor_chain,
    factor_update,
    series_after,
    series_chain,
)

LEAST_REST = 1e-2
"""Least variance of what is left over of a column, relative to that of the noise."""
MEMORY = 0.9
"""Weight of the frames before when surprise is measured."""
RISE, FALL, MOST = 4.0, 0.8, 1e6
"""How much wider in a frame what is left over may be taken to vary, how much narrower, and how much
wider at all than in training."""
FAR, GROSS = 6.0, 1.0
"""A number so many standard deviations off, and so many normalised units, is ignored for a
frame: nothing moves so far so quickly, but bad markers do."""
NOISE_FRAMES = 120
"""Frames that noise is estimated from."""
OTHER_NOISE = 2.0
"""Change of the noise's variance, as a factor, after which what was learned with it is void."""
SETTLED = 1e-4
"""Relative change of the covariance in a frame below which it is taken to have settled."""

TINY = 1e-300

Seen = BoolArray | None
"""Which columns (d,) were observed; None: all."""


class MotionFilter:
    """Filter that cleans one frame after the other.

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
        self._begun = self._looked = False
        self._was_off: Seen = None

    def set_noise(self, sigma: float) -> None:
        """Change the noise."""
        self._shared.set_noise(self._motion.seen_with(sigma))
        self._rest.set_noise(sigma**2)
        self._looked = False

    def look_ahead(self) -> None:
        """Predict the next frame; `step` does it where nobody did."""
        if not self._looked:
            self._shared.look_ahead()
            self._rest.look_ahead()
            self._looked = True

    def step(self, frame: FloatArray, seen: Seen = None) -> FloatArray:
        """The mean (d,) of one more normalised frame (d,), where `seen`."""
        self.look_ahead()
        seen = self._accepted(frame, seen)
        mean = self._shared.step(frame, seen)
        rest = self._rest.step(frame - mean, seen)
        self._begun, self._looked = True, False
        return mean + rest

    @property
    def variance(self) -> FloatArray:
        """Variance of the latest mean, (d,)."""
        return self._shared.variance + self._rest.variance

    def _accepted(self, frame: FloatArray, seen: Seen) -> Seen:
        """Columns seen that are accepted: a far-off value counts from its second time on."""
        if not self._begun:
            return seen
        shared, rest = self._shared, self._rest
        off = np.abs(frame - (shared.expected + rest.expected))
        was_off, self._was_off = self._was_off, None
        if not (off > GROSS).any():  # never where NaN
            return seen
        spread = np.sqrt(shared.variance + rest.predicted)
        self._was_off = np.asarray(off > np.maximum(FAR * spread, GROSS))
        is_new = self._was_off if was_off is None else self._was_off & ~was_off
        return ~is_new if seen is None else seen & ~is_new


@dataclass(frozen=True, eq=False)
class _Gain:
    """The update of the factors by a frame that shows some columns, whatever its values."""

    seen: Seen
    gain: FloatArray  # (2 q, d)
    P: FloatArray  # (2 q, 2 q): The covariance after the frame
    variance: FloatArray  # (d,): Of what the factors then make of each column
    settled: bool  # Whether another such frame will do the same

    def is_for(self, seen: Seen) -> bool:
        if seen is None or self.seen is None:
            return seen is self.seen
        return np.array_equal(seen, self.seen)


class _FactorFilter:
    """A Kalman filter of the factors and their velocities, see `smoothing.smooth_factors`."""

    def __init__(self, factors: MotionFactors, rates: FloatArray) -> None:
        self._factors = factors
        q, d = factors.count, len(factors.mean)
        self._F, self._Q = factor_chain(rates)
        self._m = self._m_ahead = np.zeros(2 * q)
        start = _Gain(None, np.zeros((2 * q, d)), np.eye(2 * q), np.zeros(d), settled=False)
        self._last = self._next = start
        self.expected = factors.mean
        """The next frame, (d,), before it is seen."""

    @property
    def variance(self) -> FloatArray:
        """Variance of the latest mean, (d,)."""
        return self._last.variance

    def set_noise(self, factors: MotionFactors) -> None:
        """Change the noise."""
        self._factors, self._last = factors, replace(self._last, settled=False)

    def look_ahead(self) -> None:
        """Predict the next frame, and its gain if it shows the columns of the last one."""
        factors, last = self._factors, self._last
        self._m_ahead = self._F @ self._m
        self.expected = factors.mean + factors.weights @ self._m_ahead[: factors.count]
        self._next = last if last.settled else self._update(last.seen)

    def step(self, frame: FloatArray, seen: Seen) -> FloatArray:
        """The mean (d,) of a frame by the factors."""
        if not self._next.is_for(seen):
            self._next = self._update(seen)
        self._last = self._next
        change = self._last.gain @ _known(frame - self.expected, seen)
        self._m = self._m_ahead + change
        return np.asarray(self.expected + self._factors.weights @ change[: self._factors.count])

    def _update(self, seen: Seen) -> _Gain:
        factors, q, before = self._factors, self._factors.count, self._last.P
        weight = 1.0 / factors.noise if seen is None else seen / factors.noise
        weighted = factors.weights * weight[:, None]
        precision = factors.weights.T @ weighted
        update = factor_update(self._F @ before @ self._F.T + self._Q, precision)
        after = update.after
        change = np.abs(after.diagonal() - before.diagonal()).max()
        return _Gain(
            seen,
            gain=update.weight @ weighted.T,
            P=after,
            variance=factors.variance(after[None, :q, :q])[0],
            settled=bool(change < SETTLED * after.diagonal().min()),
        )


class _SeriesFilter:
    """An adaptive Kalman filter of independent series, see `smoothing.smooth_series`."""

    def __init__(self, variance: FloatArray, rates: FloatArray, noise: float) -> None:
        self._chain, self._noise = series_chain(variance, rates), noise
        self._m = self._m_ahead = np.zeros((2, len(variance)))
        self._begin()

    def _begin(self) -> None:
        """Return to the prior covariance, at the present values and at rest."""
        self._m = self._m * [[1.0], [0.0]]
        # Covariance before the latest frame was seen, and its gain.
        self._P, self._gain = self._chain.prior, np.zeros_like(self._m)
        self._P_ahead = self._chain.prior
        self._width = np.ones_like(self._chain.prior[0])
        self._found = self._predicted = self._chain.prior[0] + self._noise

    @property
    def expected(self) -> FloatArray:
        """The next values, (d,), before they are seen."""
        return np.asarray(self._m_ahead[0])

    @property
    def predicted(self) -> FloatArray:
        """Variance of the next values, with the noise, (d,)."""
        return np.asarray(self._P_ahead[0] + self._noise)

    @property
    def variance(self) -> FloatArray:
        """Variance of the latest mean, (d,)."""
        return np.asarray(self._P[0] * (1.0 - self._gain[0]))

    def set_noise(self, noise: float) -> None:
        """Change the variance of the noise."""
        before, self._noise = self._noise, noise
        self._predicted = self._predicted + (noise - before)
        if not before / OTHER_NOISE < noise < before * OTHER_NOISE:
            self._begin()  # what was learned took noise for motion, or motion for noise

    def look_ahead(self) -> None:
        """Predict the next values."""
        self._m_ahead = carried(self._chain.F, self._m)
        self._P_ahead = self._chain.carry(series_after(self._P, self._gain), self._width)

    def step(self, values: FloatArray, seen: Seen) -> FloatArray:
        """The mean (d,) after one more value of each."""
        surprise = _known(values - self._m_ahead[0], seen)
        self._P = P = self._P_ahead * self._widened(surprise, seen)
        gain = P[:2] / (P[0] + self._noise)
        self._gain = gain if seen is None else gain * seen
        self._m = self._m_ahead + self._gain * surprise
        return np.asarray(self._m[0])

    def _widened(self, surprise: FloatArray, seen: Seen) -> FloatArray:
        """Factors by which the variance of each series changes after this surprise, (d,)."""
        fresh = 1.0 - MEMORY if seen is None else (1.0 - MEMORY) * seen
        self._found = self._found + fresh * (surprise * surprise - self._found)
        self._predicted = self._predicted + fresh * (self.predicted - self._predicted)
        ratio = (self._found - self._noise) / np.maximum(self._predicted - self._noise, TINY)
        change = np.minimum(np.maximum(ratio, FALL), RISE)  # np.clip takes three times as long
        before = self._width
        widened = before * (change if seen is None else np.where(seen, change, 1.0))
        self._width = np.minimum(np.maximum(widened, 1.0), MOST)
        return np.asarray(self._width / before)


def _known(values: FloatArray, seen: Seen) -> FloatArray:
    """Values (d,), 0 where they were not seen."""
    return values if seen is None else np.where(seen, values, 0.0)


class NoiseMeter:
    """Estimates the noise of a live source anew every `NOISE_FRAMES` frames."""

    def __init__(self, columns: int) -> None:
        self._frames = np.full((NOISE_FRAMES, columns), np.nan)
        self._count = 0

    def step(self, frame: FloatArray) -> float | None:
        """The standard deviation of the noise in the last frames, when they are all new."""
        self._frames[self._count % NOISE_FRAMES] = frame
        self._count += 1
        if self._count % NOISE_FRAMES or not np.isfinite(self._frames).any():
            return None
        return capture_noise(self._frames)
