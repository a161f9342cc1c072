"""Regression of the target on the source, from the key frames alone.

A few keys leave a map from all feature points to all feature points open. Three assumptions decide:
the target moves as the scaled source does, a point follows those near it more than those far away,
and the map is nearly linear. It is a kernel ridge regression,

    y_p(t) = s x_p(t) + c + k_p(t, keys) (k_p(keys, keys) + λ)⁻¹ (Ŷ_p - s X_p - c),

with c the mean over the keys and the kernel k_p = l_p + κ exp(-d_p² / 2 ℓ²) + τ k. Its linear part
is l_p(t, u) = Σ_q w_pq x_q(t)·x_q(u), where w_pq = exp(-|p - q| / h) + w₀ falls with the distance
of the feature points at rest, and d_p is the distance that belongs to it,
d_p²(t, u) = l_p(t, t) + l_p(u, u) - 2 l_p(t, u). k is the covariance of a smooth path in time, with
the weight τ that it deserves (`facert.topology.smooth_path`). The results for several λ and κ are
averaged by their leave-one-out errors.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from facert.data.arrays import FloatArray
from facert.data.memory import require_square
from facert.models.kernels import squared_exponential
from facert.models.loo import KernelRidge, leave_one_out_errors
from facert.topology.affine import scaled_source
from facert.topology.keyed import KeyedPerformance
from facert.topology.smooth_path import SmoothPath, trust_in_path

REACH = 0.3  # h, in units of the face's radius
EVERYWHERE = 0.003  # w₀
PENALTIES = (1e-2, 1e-3, 1e-4, 1e-5)  # λ, where the mean of l_p(t, t) over the keys is 1
CURVATURES = (0.03, 0.3)  # κ
BATCH = 256  # frames: for bounded memory
LENGTH = 2.0  # ℓ, where two keys are √2 apart
TRUST = 0.1  # in leave-one-out errors, a key: see _trusts
LEAST = 1e-12  # of what a key may weigh in its own prediction


def local_ridge(take: KeyedPerformance) -> FloatArray:
    """Kernel ridge regression towards the scaled source, (T, G, C).

    The parameters of a rig have no place and no source of their own: they follow all points alike,
    and are drawn towards their mean.
    """
    if not take.by_point:
        nothing = np.zeros((len(take), *take.labels.shape[1:]))
        return _kernel_ridge(take, nothing, np.ones((1, take.source.shape[1])))
    scaled = scaled_source(take)
    return scaled + _kernel_ridge(take, scaled, _nearness(take.source.mean(axis=0)))


def _nearness(rest: FloatArray) -> FloatArray:
    """Weights w_pq between feature points at rest (M, 3), (M, M)."""
    require_square(len(rest), "feature points", "Give fewer.")
    radius = np.sqrt(np.mean(np.sum((rest - rest.mean(axis=0)) ** 2, axis=1)))
    distance = cdist(rest, rest) / (radius or 1.0)
    return np.asarray(np.exp(-distance / REACH) + EVERYWHERE)


def _kernel_ridge(take: KeyedPerformance, first: FloatArray, weights: FloatArray) -> FloatArray:
    """Ridge estimate of the target less a first one (T, G, C), with weights w_pq (G, M)."""
    left = take.less(first).labels
    mean = left.mean(axis=0)
    targets = (left - mean).transpose(1, 0, 2)
    centred = take.source - take.source[take.keys].mean(axis=0)
    kernels = _Kernels(centred[take.keys], weights)
    path = _trusted_path(take, kernels.linear, targets)
    fits = [_dual_weights(kernel, targets) for kernel in kernels(kernels.keys, path[take.keys])]
    trusts = _trusts(np.array([errors for _, errors in fits]), len(take.keys))
    alphas = [
        np.tensordot(trust, alpha, axes=1) for trust, (alpha, _) in zip(trusts, fits, strict=True)
    ]
    found = np.empty((len(take), *mean.shape))
    for start in range(0, len(take), BATCH):
        rows = slice(start, start + BATCH)
        batch = kernels(centred[rows], path[rows])
        parts = [k @ alpha for k, alpha in zip(batch, alphas, strict=True)]
        found[rows] = np.sum(parts, axis=0).transpose(1, 0, 2)
    return np.asarray(found + mean)


def _trusted_path(take: KeyedPerformance, linear: FloatArray, targets: FloatArray) -> FloatArray:
    """The path's kernel τ k of all frames with the keys, (T, K)."""
    path = SmoothPath(len(take), take.keys)
    motion = float(np.sum((take.labels - take.labels.mean(axis=0)) ** 2))
    _, errors = _dual_weights(linear, targets)
    by_map = float(np.sqrt(errors.min() / motion)) if motion > 0 else 0.0
    return trust_in_path(path.missed(take), by_map) * path.covariance()


class _Kernels:
    """Kernels k_p between frames and keys, with no mean over the keys, for every κ."""

    def __init__(self, keys: FloatArray, weights: FloatArray) -> None:
        """Prepare the kernels of the keys' source (K, M, 3), less its mean, with w_pq (G, M)."""
        self.keys, self._weights = keys, weights
        self._own = self._powers(keys)
        size = self._own.mean(axis=1)
        self._size = np.where(size > 0, size, 1.0)[:, None, None]
        self._mean = self._bell(keys, self._linear(keys)).mean(axis=1, keepdims=True)

    @property
    def linear(self) -> FloatArray:
        """The linear part l_p alone between the keys, (G, K, K)."""
        return self._linear(self.keys) / self._size

    def __call__(self, frames: FloatArray, path: FloatArray) -> list[FloatArray]:
        """The kernels (G, n, K) of frames (n, M, 3), τ k (n, K) among them, less the keys' mean."""
        linear = self._linear(frames)
        bell = self._bell(frames, linear) - self._mean
        sure = linear / self._size + path
        return [sure + curvature * bell for curvature in CURVATURES]

    def _linear(self, frames: FloatArray) -> FloatArray:
        """Linear kernels l_p of frames and keys, (G, n, K)."""
        products = np.einsum("tqc,kqc->qtk", frames, self.keys)
        return np.asarray(np.tensordot(self._weights, products, axes=1))

    def _bell(self, frames: FloatArray, linear: FloatArray) -> FloatArray:
        """The exponential of the distances, without a mean over the keys in each row, (G, n, K)."""
        squared = self._powers(frames)[:, :, None] + self._own[:, None, :] - 2.0 * linear
        bell: FloatArray = squared_exponential(squared, 1.0 / (LENGTH**2 * self._size))
        return np.asarray(bell - bell.mean(axis=2, keepdims=True))

    def _powers(self, frames: FloatArray) -> FloatArray:
        """Linear kernels l_p(t, t) of frames with themselves, (G, n)."""
        return np.asarray(self._weights @ np.einsum("tqc,tqc->qt", frames, frames))


def _dual_weights(kernel: FloatArray, targets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """α = (k + λ)⁻¹ Ŷ for every λ, (L, G, K, C), and the leave-one-out error of each, (L,).

    Kernel (G, K, K) and targets (G, K, C) have no mean over the K keys, so that the constant is an
    eigenvector of the kernel for the eigenvalue 0. A key that is left out, of the mean as well, is
    missed by α_i / (((k + λ)⁻¹)_ii - 1 / (K λ)).
    """
    ridge, keys, alphas, errors = KernelRidge.of(kernel, targets), kernel.shape[1], [], []
    for penalty in PENALTIES:
        alpha = ridge.weights(penalty)
        diagonal = np.maximum(ridge.diagonal(penalty) - 1.0 / (keys * penalty), LEAST)
        alphas.append(alpha)
        errors.append(float(np.sum(leave_one_out_errors(alpha, diagonal) ** 2)))
    return np.array(alphas), np.array(errors)


def _trusts(errors: FloatArray, keys: int) -> FloatArray:
    """Weights of regressions by their leave-one-out errors E, of the same shape, that sum to 1.

    With few keys the errors are rough: a regression has the weight E^(-K/10), which comes
    to a choice as the keys grow many.
    """
    least = errors.min()
    weights = (errors / least) ** (-TRUST * keys) if least > 0 else np.ones_like(errors)
    return np.asarray(weights / weights.sum())
