"""Regression of the target on the source, from the key frames alone.

A few keys say little about a map from all feature points to all feature points. What they leave
open is decided by two beliefs: the target moves as the scaled source does, and a point follows
those near it more than those far away. The map is a ridge regression in its dual form: with
k_p(t, u) = Σ_q w_pq x_q(t)·x_q(u), where w_pq = exp(-|p - q| / h) + w₀ falls with the distance of
the feature points at rest,

    y_p(t) = s x_p(t) + c + k_p(t, keys) (k_p(keys, keys) + λ)⁻¹ (Ŷ_p - s X_p - c),

with c the mean over the keys, and averaged over several λ by how well each does when a key is left
out.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from facert.data import FloatArray
from facert.topology.keyed import KeyedPerformance

REACH = 0.3  # h, in units of the face's radius
EVERYWHERE = 0.01  # w₀
PENALTIES = (1e-2, 1e-3, 1e-4, 1e-5)  # λ, where the mean of k_p(t, t) over the keys is 1
TRUST = 0.1  # in leave-one-out errors, a key: see _dual_weights
LEAST = 1e-12  # of what a key may weigh in its own prediction
RANK = 1e-5  # least share of the largest singular value that is no rounding, in an affine map


def local_ridge(take: KeyedPerformance) -> FloatArray:
    """Ridge regression towards the scaled source, (T, G, C).

    The parameters of a rig have no place and no source of their own: they follow all points alike,
    and are drawn towards their mean.
    """
    if not take.by_point:
        return _dual_ridge(take, np.ones((1, take.source.shape[1])))
    guess = scaled_source(take)
    return guess + _dual_ridge(take.less(guess), _nearness(take.source.mean(axis=0)))


def affine_regression(take: KeyedPerformance) -> FloatArray:
    """The affine map from whole frames to the target that has the smallest entries, (T, G, C)."""
    mean, X = take.labels.mean(axis=0), take.frames - take.frames[take.keys].mean(axis=0)
    targets = (take.labels - mean).reshape(len(take.keys), -1)
    weights, *_ = np.linalg.lstsq(X[take.keys], targets, rcond=RANK)
    return np.asarray((X @ weights).reshape(len(take), *mean.shape) + mean)


def scaled_source(take: KeyedPerformance) -> FloatArray:
    """The source times s, the ratio of target to source motion over the keys, (T, M, 3)."""
    source, target = _centred_keys(take)
    motion = float(np.sum(source**2))
    scale = float(np.sum(source * target)) / motion if motion > 0 else 0.0
    return scale * take.source


def scaled_points(take: KeyedPerformance) -> FloatArray:
    """The source, each feature point times the ratio of its own motion over the keys, (T, M, 3)."""
    source, target = _centred_keys(take)
    motion = np.sum(source**2, axis=(0, 2))
    product = np.sum(source * target, axis=(0, 2))
    scale = np.divide(product, motion, out=np.zeros_like(motion), where=motion > 0)
    return np.asarray(scale[:, None] * take.source)


def _nearness(rest: FloatArray) -> FloatArray:
    """w_pq between feature points at rest (M, 3), (M, M)."""
    radius = np.sqrt(np.mean(np.sum((rest - rest.mean(axis=0)) ** 2, axis=1)))
    distance = cdist(rest, rest) / (radius or 1.0)
    return np.asarray(np.exp(-distance / REACH) + EVERYWHERE)


def _dual_ridge(take: KeyedPerformance, weights: FloatArray) -> FloatArray:
    """The regression with weights w_pq (G, M), the mean of the keys taken off, (T, G, C)."""
    keys = take.keys
    centred = take.source - take.source[keys].mean(axis=0)
    products = np.einsum("tqc,kqc->qtk", centred, centred[keys])
    kernel = np.tensordot(weights, products, axes=1)  # (G, T, K)
    size = np.trace(kernel[:, keys], axis1=1, axis2=2) / len(keys)
    kernel /= np.where(size > 0, size, 1.0)[:, None, None]
    mean = take.labels.mean(axis=0)
    targets = (take.labels - mean).transpose(1, 0, 2)
    found = kernel @ _dual_weights(kernel[:, keys], targets)  # (G, T, C)
    return np.asarray(found.transpose(1, 0, 2) + mean)


def _dual_weights(kernel: FloatArray, targets: FloatArray) -> FloatArray:
    """α = (k + λ)⁻¹ Ŷ, (G, K, C), averaged over λ.

    Kernel (G, K, K) and targets (G, K, C) have no mean over the K keys, so that the constant is an
    eigenvector of the kernel for the eigenvalue 0. A key that is left out, of the mean as well, is
    missed by α_i / (((k + λ)⁻¹)_ii - 1 / (K λ)). With few keys these errors E are a rough guess:
    each λ has the weight E^(-K/10), which comes to a choice as the keys grow many.
    """
    values, vectors = np.linalg.eigh(kernel)
    projected = vectors.transpose(0, 2, 1) @ targets
    keys, found, errors = kernel.shape[1], [], []
    for penalty in PENALTIES:
        inverse = 1.0 / (np.maximum(values, 0.0) + penalty)  # (G, K)
        alpha = vectors @ (inverse[:, :, None] * projected)
        own = np.sum(vectors**2 * inverse[:, None, :], axis=2) - 1.0 / (keys * penalty)
        found.append(alpha)
        errors.append(float(np.sum((alpha / np.maximum(own, LEAST)[:, :, None]) ** 2)))
    least = min(errors)
    relative = np.array(errors) / least if least > 0 else np.ones(len(errors))
    weights = relative ** (-TRUST * keys)
    return np.tensordot(weights / weights.sum(), np.array(found), axes=1)


def _centred_keys(take: KeyedPerformance) -> tuple[FloatArray, FloatArray]:
    """Source and target of the keys less their means, each (K, M, 3)."""
    source = take.source[take.keys]
    return source - source.mean(axis=0), take.labels - take.labels.mean(axis=0)
