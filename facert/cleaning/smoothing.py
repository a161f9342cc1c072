"""The joint Gaussian estimate over time: Kalman filter, then Rauch, Tung and Striebel's smoother.

One recursion over the frames, forward and back, for factors that are observed together, and one for
series that are observed each on its own (all at once). Arrays of the former have time first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.cleaning.matern import transition
from facert.data import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Factors given all frames.

    Parameters
    ----------
    mean : array, shape (T, ..., q)
    covariance : array, shape (T, ..., q, q)
    following : array, shape (T - 1, ..., q)
        E[z_t z_{t+1}] of each factor.
    """

    mean: FloatArray
    covariance: FloatArray
    following: FloatArray


def smooth_factors(precision: FloatArray, pull: FloatArray, a: FloatArray) -> Smoothed:
    """Smooth factors, each of unit variance and moving as `matern` has it.

    Parameters
    ----------
    precision : array, shape (T, ..., q, q)
        What each frame tells of its factors.
    pull : array, shape (T, ..., q)
        Precision times the factors that the frame tells of.
    a : array, shape (q,)
        How quickly each factor moves, see `matern.decay`.
    """
    frames, q = len(pull), pull.shape[-1]
    F = np.block([[np.diag(block) for block in row] for row in transition(a)])
    Q = np.eye(2 * q) - F @ F.T
    m = np.zeros((*pull.shape[1:-1], 2 * q))
    P = np.broadcast_to(np.eye(2 * q), (*m.shape, 2 * q))
    before, after = (np.empty((frames, *m.shape)) for _ in range(2))
    P_before, P_after = (np.empty((frames, *P.shape)) for _ in range(2))
    for t in range(frames):
        if t:
            m, P = m @ F.T, F @ P @ F.T + Q
        before[t], P_before[t] = m, P
        seen = P[..., :q] @ np.linalg.inv(np.eye(q) + precision[t] @ P[..., :q, :q])
        news = pull[t] - (precision[t] @ m[..., :q, None])[..., 0]
        m = m + (seen @ news[..., None])[..., 0]
        P = P - seen @ precision[t] @ P[..., :q, :]
        P = (P + np.swapaxes(P, -1, -2)) / 2.0
        after[t], P_after[t] = m, P
    gain = P_after[:-1] @ F.T @ np.linalg.inv(P_before[1:])
    together = np.empty((frames - 1, *pull.shape[1:]))
    for t in range(frames - 2, -1, -1):
        cross = gain[t] @ P_after[t + 1]
        together[t] = np.diagonal(cross, axis1=-2, axis2=-1)[..., :q]
        after[t] += (gain[t] @ (after[t + 1] - before[t + 1])[..., None])[..., 0]
        change = cross - gain[t] @ P_before[t + 1]
        P_after[t] += change @ np.swapaxes(gain[t], -1, -2)
    mean = after[..., :q]
    return Smoothed(mean, P_after[..., :q, :q], mean[:-1] * mean[1:] + together)


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
        Of each series.
    noise : float
        Variance of an observation.
    a : array, shape (d,)
        How quickly each series moves, see `matern.decay`.

    Returns
    -------
    mean, variance : array, shape (T, d)
    """
    frames, d = X.shape
    F = transition(a).transpose(2, 0, 1)
    Q = variance[:, None, None] * (np.eye(2) - F @ F.transpose(0, 2, 1))
    states = np.empty((frames, 2, 5, d))  # before and after; value, velocity, their covariance
    m, P = np.zeros((2, d)), np.stack([variance, np.zeros(d), variance])
    forward = forward_covariance(transition(a))
    drift = np.stack([Q[:, 0, 0], Q[:, 0, 1], Q[:, 1, 1]])
    f = F.transpose(1, 2, 0)
    for t in range(frames):
        if t:
            m = f[:, 0] * m[0] + f[:, 1] * m[1]
            P = (forward * P).sum(axis=1) + drift
        states[t, 0, :2], states[t, 0, 2:] = m, P
        gain = np.where(seen[t], P[:2] / (P[0] + noise), 0.0)
        m = m + gain * (np.where(seen[t], X[t], 0.0) - m[0])
        P = P - np.stack([gain[0] * P[0], gain[0] * P[1], gain[1] * P[1]])
        states[t, 1, :2], states[t, 1, 2:] = m, P
    return _backward(states, F)


def forward_covariance(F: FloatArray) -> FloatArray:
    """Takes the covariance of value and velocity one frame on, (3, 3, d), by `transition` F."""
    (p, q), (r, s) = F
    return np.stack(
        [
            np.stack([p * p, 2.0 * p * q, q * q]),
            np.stack([p * r, p * s + q * r, q * s]),
            np.stack([r * r, 2.0 * r * s, s * s]),
        ]
    )


def _backward(states: FloatArray, F: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Smooth what was filtered; mean and variance of the value, (T, d)."""
    before, after = (np.moveaxis(states[:, side], -1, 1) for side in range(2))  # (T, d, 5)
    P_before, P_after = _matrices(before[1:]), _matrices(after[:-1])
    gain = P_after @ F.transpose(0, 2, 1) @ _inverses(P_before)
    left = _matrices(after[:-1]) - gain @ P_before @ np.swapaxes(gain, -1, -2)
    mean, variance = states[:, 1, 0].copy(), states[:, 1, 2].copy()
    m, P = after[-1, :, :2], _matrices(after[-1:])[0]
    for t in range(len(states) - 2, -1, -1):
        m = after[t, :, :2] + np.einsum("dij,dj->di", gain[t], m - before[t + 1, :, :2])
        P = left[t] + gain[t] @ P @ gain[t].transpose(0, 2, 1)
        mean[t], variance[t] = m[:, 0], P[:, 0, 0]
    return mean, variance


def _matrices(states: FloatArray) -> FloatArray:
    """Covariances (..., 2, 2) of states (..., 5)."""
    return np.asarray(states[..., [2, 3, 3, 4]].reshape(*states.shape[:-1], 2, 2))


def _inverses(P: FloatArray) -> FloatArray:
    """Of symmetric (..., 2, 2)."""
    p, q, s = P[..., 0, 0], P[..., 0, 1], P[..., 1, 1]
    adjoint = np.stack([s, -q, -q, p], axis=-1).reshape(P.shape)
    return np.asarray(adjoint / (p * s - q * q)[..., None, None])
