"""Smooth motion in time: a Gaussian process with the Matérn kernel of order 3/2, and its smoother.

Its correlation over one frame is ρ = (1 + a) exp(-a). Such a process has a velocity; together they
are a Markov chain (Hartikainen and Särkkä 2010), so the joint estimate over all frames takes a
Kalman filter and Rauch, Tung and Striebel's smoother.

One recursion over the frames, forward and back, for factors that are observed together, and one for
series that are observed each on its own (all at once). Arrays of the former have time first.

Covariances depend on which entries were observed, not on their values. Where frames show the same
entries for a while, they soon no longer change from frame to frame; from there on only the means
go on. Most of a take is like that, and costs a tenth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import lambertw

from facert.data.arrays import BoolArray, FloatArray

SLOWEST, QUICKEST = 0.02, 4.0
"""Range of a: motion that takes some 100 frames, and hardly any memory from frame to frame."""
SETTLED = 1e-10
"""A covariance that changes no more than by this, relative to its variances, no longer does."""


def decay(correlation: FloatArray) -> FloatArray:
    """The rate a of processes whose values in neighbouring frames are correlated so, (q,)."""
    inside = np.clip(correlation, 0.0, 1.0 - 1e-6)  # at 1 rounding leaves the range of W
    return np.clip(-1.0 - np.real(lambertw(-inside / np.e, -1)), SLOWEST, QUICKEST)


def transition(a: FloatArray) -> FloatArray:
    """Transition of value and velocity of each process, both of unit variance, (2, 2, q)."""
    return np.asarray(np.exp(-a) * np.array([[1.0 + a, a], [-a, 1.0 - a]]))


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Factors given all frames."""

    mean: FloatArray  # (T, ..., q)
    covariance: FloatArray  # (T, ..., q, q)
    following: FloatArray  # (T - 1, ..., q): E[z_t z_{t+1}] of each factor


class FactorUpdate(NamedTuple):
    """Covariances of factors and velocities before and after a frame is seen.

    The frame takes the mean m to keep m + weight pull.
    """

    before: FloatArray
    after: FloatArray
    keep: FloatArray
    weight: FloatArray


def smooth_factors(precision: FloatArray, pull: FloatArray, a: FloatArray) -> Smoothed:
    """Smooth factors, each of unit variance and moving as this file has it.

    Parameters
    ----------
    precision : array, shape (T, ..., q, q)
        Precision of each frame's factors by what it shows.
    pull : array, shape (T, ..., q)
        The same times the factors that it shows.
    a : array, shape (q,)
        How quickly each factor moves, see `decay`.
    """
    frames, q = len(pull), pull.shape[-1]
    F, drift = factor_chain(a)
    if precision.ndim > 3 and (precision == precision[:, :1]).all():
        precision = precision[:, :1]  # all stretches are known equally well
    filtered = _filtered(precision, F, drift)
    m = np.zeros((*pull.shape[1:-1], 2 * q))
    before, after = (np.empty((frames, *m.shape)) for _ in range(2))
    for t, update in enumerate(filtered):
        before[t] = m @ F.T if t else m
        m = _times(update.keep, before[t]) + _times(update.weight, pull[t])
        after[t] = m
    return _smoothed(filtered, F, before, after)


def _filtered(precision: FloatArray, F: FloatArray, drift: FloatArray) -> list[FactorUpdate]:
    """The filter's update at each frame; where covariances have settled, the very same object."""
    P = np.broadcast_to(np.eye(len(F)), (*precision.shape[1:-2], *F.shape))
    found: list[FactorUpdate] = []
    for frame, repeats in zip(precision, _repeats(precision), strict=True):
        if repeats and len(found) > 1 and found[-1] is found[-2]:
            found.append(found[-1])
            continue
        if found:
            P = F @ found[-1].after @ F.T + drift
        same = repeats and _settled(P, found[-1].before)
        found.append(found[-1] if same else factor_update(P, frame))
    return found


def _repeats(frames: FloatArray | BoolArray) -> BoolArray:
    """Mask of frames (T, ...) that equal the one before, (T,)."""
    same = (frames[1:] == frames[:-1]).all(axis=tuple(range(1, frames.ndim)))
    return np.concatenate([[False], same])


def factor_update(P: FloatArray, precision: FloatArray) -> FactorUpdate:
    """The update of covariances (..., 2 q, 2 q) by a frame of some precision, (..., q, q)."""
    q = precision.shape[-1]
    weight = P[..., :q] @ np.linalg.inv(np.eye(q) + precision @ P[..., :q, :q])
    gain = weight @ precision
    keep = np.broadcast_to(np.eye(2 * q), P.shape).copy()
    keep[..., :q] -= gain
    after = P - gain @ P[..., :q, :]
    return FactorUpdate(P, (after + np.swapaxes(after, -1, -2)) / 2.0, keep, weight)


def _settled(P: FloatArray, last: FloatArray) -> bool:
    """Whether covariances (..., n, n) have stopped changing."""
    deviation = np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))
    scale = deviation[..., :, None] * deviation[..., None, :]
    return bool((np.abs(P - last) <= SETTLED * scale).all())


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Matrices (..., n, k) times vectors (..., k)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _smoothed(
    filtered: list[FactorUpdate], F: FloatArray, before: FloatArray, after: FloatArray
) -> Smoothed:
    """The backward pass; overwrites the filter's means `before` and `after`, (T, ..., 2 q)."""
    frames, q = len(filtered), F.shape[0] // 2
    P = filtered[-1].after
    covariance = np.empty((frames, *P.shape[:-2], q, q))
    together = np.empty((frames - 1, *P.shape[:-2], q))
    covariance[-1] = P[..., :q, :q]
    settled = False
    for t in range(frames - 2, -1, -1):
        here, following = filtered[t], filtered[t + 1]
        same = t + 2 < frames and here is following is filtered[t + 2]
        if not same:
            gain = here.after @ F.T @ np.linalg.inv(following.before)
        if not (same and settled):
            cross = gain @ P
            last, P = P, here.after + (cross - gain @ following.before) @ np.swapaxes(gain, -1, -2)
            settled = same and _settled(P, last)
        covariance[t], together[t] = P[..., :q, :q], np.diagonal(cross, axis1=-2, axis2=-1)[..., :q]
        after[t] += _times(gain, after[t + 1] - before[t + 1])
    mean = after[..., :q]
    shape = (frames, *mean.shape[1:], q)
    return Smoothed(mean, np.broadcast_to(covariance, shape), mean[:-1] * mean[1:] + together)


def smooth_series(
    X: FloatArray, seen: BoolArray, variance: FloatArray, noise: float, a: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Smooth independent series, all at once.

    Parameters
    ----------
    X : array, shape (T, d)
        Observations, where `seen`.
    seen : array of bool, shape (T, d)
    variance : array, shape (d,)
        Variance of each series.
    noise : float
        Variance of an observation.
    a : array, shape (d,)
        How quickly each series moves, see `decay`.

    Returns
    -------
    mean, variance : array, shape (T, d)
    """
    chain, X = series_chain(variance, a), np.where(seen, X, 0.0)
    mean, expected = _series_filtered(X, seen, noise, chain)
    # What is seen from a frame on, of its value and velocity: precision (3, d), and that times m.
    precision, pull = np.zeros((3, len(a))), np.zeros((2, len(a)))
    F, spread = chain.F.swapaxes(0, 1), np.empty(X.shape)
    back, settled = forward_covariance(F), False
    for t in range(len(X) - 1, -1, -1):
        same = t + 1 < len(X) and expected[t] is expected[t + 1]
        if not same:
            p, q, _ = expected[t]
            weight = seen[t] / (p + noise)
            gain, keep = q * weight, 1.0 - p * weight
        if not (same and settled):
            known = _and_seen(precision, weight, gain, keep)
            left = p - (p * (p * known[0] + 2.0 * q * known[1]) + q * q * known[2])
            last, precision = precision, (back * known).sum(axis=1)
            settled = same and _series_settled(precision, last)
        value, velocity = pull
        value = keep * value - gain * velocity + weight * (X[t] - mean[t])
        mean[t] += p * value + q * velocity
        spread[t] = left
        pull = F[:, 0] * value + F[:, 1] * velocity
    return mean, spread


def _and_seen(
    precision: FloatArray, weight: FloatArray, gain: FloatArray, keep: FloatArray
) -> FloatArray:
    """Precision (3, d) by the frames after one, and by what that itself shows."""
    p, q, s = precision
    mixed = keep * q - gain * s
    return np.stack([weight + keep * (keep * p - gain * q) - gain * mixed, mixed, s])


def _series_filtered(
    X: FloatArray, seen: BoolArray, noise: float, chain: SeriesChain
) -> tuple[FloatArray, list[FloatArray]]:
    """Means (T, d) and covariances, (3, d) each, before each frame is seen.

    Where frames show the same and covariances have settled, these are the very same object.
    """
    mean, expected = np.empty(X.shape), [chain.prior]
    m, gain, settled = np.zeros((2, X.shape[1])), np.zeros((2, X.shape[1])), False
    for t, repeats in enumerate(_repeats(seen)):
        P, settled = expected[-1], settled and bool(repeats)
        if t:
            m = carried(chain.F, m)
            if not settled:
                ahead = chain.carry(series_after(P, gain))
                settled = bool(repeats) and _series_settled(ahead, P)
                P = P if settled else ahead
            expected.append(P)
        if not settled:
            gain = np.where(seen[t], P[:2] / (P[0] + noise), 0.0)
        mean[t] = m[0]
        m += gain * (X[t] - m[0])
    return mean, expected


def carried(F: FloatArray, m: FloatArray) -> FloatArray:
    """F (2, 2, d) times value and velocity (2, d)."""
    return np.asarray(F[:, 0] * m[0] + F[:, 1] * m[1])


def _series_settled(P: FloatArray, last: FloatArray) -> bool:
    """Whether covariances (3, d) have stopped changing."""
    scale = np.stack([P[0], np.sqrt(P[0] * P[2]), P[2]])
    return bool((np.abs(P - last) <= SETTLED * scale).all())


def factor_chain(a: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Transition of factors and velocities at rates (q,), and its noise, (2 q, 2 q) each."""
    F = np.block([[np.diag(block) for block in row] for row in transition(a)])
    return F, np.eye(len(F)) - F @ F.T


class SeriesChain(NamedTuple):
    """Transition of series and their covariances (3, d): value, value with velocity, velocity.

    F (2, 2, d) and forward (3, 3, d) take means and covariances one frame on, to which the noise
    of the transition adds drift (3, d); before the first frame they are prior.
    """

    F: FloatArray
    forward: FloatArray
    prior: FloatArray
    drift: FloatArray

    def carry(self, P: FloatArray, width: FloatArray | float = 1.0) -> FloatArray:
        """Covariances at the next frame, with the drift so many times wider."""
        return np.asarray((self.forward * P).sum(axis=1) + width * self.drift)


def series_chain(variance: FloatArray, a: FloatArray) -> SeriesChain:
    """The chain of series of given variances and rates, (d,)."""
    F = transition(a)
    forward, prior = forward_covariance(F), np.stack([variance, np.zeros_like(variance), variance])
    return SeriesChain(F, forward, prior, prior - (forward * prior).sum(axis=1))


def series_after(P: FloatArray, gain: FloatArray) -> FloatArray:
    """Covariances (3, d) after a frame that has a gain (2, d)."""
    return P - gain[[0, 0, 1]] * P[[0, 1, 1]]


def forward_covariance(F: FloatArray) -> FloatArray:
    """Matrices (3, 3, d) that carry covariances of value and velocity one frame on by F."""
    (p, q), (r, s) = F
    return np.array(
        [
            [p * p, 2.0 * p * q, q * q],
            [p * r, p * s + q * r, q * s],
            [r * r, 2.0 * r * s, s * s],
        ]
    )
