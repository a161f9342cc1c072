"""Affine maps from the source to the target that fit the key frames best."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray
from facert.mesh.rigid import align
from facert.topology.keyed import KeyedPerformance
from facert.topology.radial_basis import FLAT

PULL = 1e-8  # towards no rotation: decides where the motion does not


def scaled_source(take: KeyedPerformance) -> FloatArray:
    """The source turned and scaled as the motion of the target asks, s x_p(t) R, (T, M, 3).

    The rotation R and s ≥ 0 are best over all feature points and keys (Kabsch 1976, Umeyama 1991):
    it does not matter which way is up in either.
    """
    motions = [motion.reshape(-1, 3) for motion in _centred_keys(take)]
    sizes = [float(np.linalg.norm(motion)) or 1.0 for motion in motions]
    source, target = (motion / size for motion, size in zip(motions, sizes, strict=True))
    weights = np.ones((1, len(source)))
    first = align(source, target[None], weights, PULL)
    # Begun at the first rotation, the pull bends nothing that the motion determines.
    motion = align(first.apply(source)[0], target[None], weights, PULL).after(first)
    rotation = motion.rotations[0].T
    scale = sizes[1] / sizes[0] * float(np.sum((source @ rotation) * target))
    return np.asarray(scale * take.source @ rotation)


def scaled_points(take: KeyedPerformance) -> FloatArray:
    """The source scaled point by point by the ratio of the motions over the keys, (T, M, 3)."""
    source, target = _centred_keys(take)
    motion = np.sum(source**2, axis=(0, 2))
    product = np.sum(source * target, axis=(0, 2))
    scale = np.divide(product, motion, out=np.zeros_like(motion), where=motion > 0)
    return np.asarray(scale[:, None] * take.source)


def affine_regression(take: KeyedPerformance) -> FloatArray:
    """The affine map from whole frames to the target that has the smallest entries, (T, G, C)."""
    mean, X = take.labels.mean(axis=0), take.frames - take.frames[take.keys].mean(axis=0)
    targets = (take.labels - mean).reshape(len(take.keys), -1)
    weights, *_ = np.linalg.lstsq(X[take.keys], targets, rcond=FLAT)
    return np.asarray((X @ weights).reshape(len(take), *mean.shape) + mean)


def _centred_keys(take: KeyedPerformance) -> tuple[FloatArray, FloatArray]:
    """Source and target of the keys less their means, each (K, M, 3)."""
    source = take.source[take.keys]
    return source - source.mean(axis=0), take.labels - take.labels.mean(axis=0)
