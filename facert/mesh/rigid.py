"""Rigid alignment of many frames at once, with weights and gaps (Kabsch 1976)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from facert.data.arrays import BoolArray, FloatArray

FLAT = 1e-3
"""Points lie on a line when their spread across it is below this share of the whole spread."""


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A rotation (T, 3, 3) and a translation (T, 3) a frame: x becomes R x + t."""

    rotations: FloatArray
    translations: FloatArray

    def apply(self, points: FloatArray) -> FloatArray:
        """R x + t for points (T, M, 3), or for the same points (M, 3) in all frames."""
        turned = np.asarray(points) @ self.rotations.transpose(0, 2, 1)
        return np.asarray(turned + self.translations[:, None])

    def undo(self, points: FloatArray) -> FloatArray:
        """Rᵀ (x - t) for points (T, M, 3)."""
        return np.asarray((points - self.translations[:, None]) @ self.rotations)

    def after(self, first: RigidMotion) -> RigidMotion:
        """Composition: first another motion, then this one; the other may be a single frame."""
        rotations = self.rotations @ first.rotations
        moved = np.einsum(
            "tij,tj->ti", self.rotations, np.broadcast_to(first.translations, (len(self), 3))
        )
        return RigidMotion(rotations, moved + self.translations)

    def inverse(self) -> RigidMotion:
        """The motion that undoes this one."""
        back = self.rotations.transpose(0, 2, 1)
        return RigidMotion(back, -np.einsum("tij,tj->ti", back, self.translations))

    def at(self, frame: int) -> RigidMotion:
        """The motion of one frame."""
        return RigidMotion(self.rotations[[frame]], self.translations[[frame]])

    def interpolated(self, time: FloatArray, known: BoolArray) -> RigidMotion:
        """The motion of all frames: between known ones the shortest way, held at both ends."""
        if known.all():
            return self
        if known.sum() == 1:
            everywhere = np.repeat(np.flatnonzero(known), len(known))
            return RigidMotion(self.rotations[everywhere], self.translations[everywhere])
        when = np.clip(time, time[known][0], time[known][-1])
        slerp = Slerp(time[known], Rotation.from_matrix(self.rotations[known]))
        moved = [np.interp(when, time[known], axis[known]) for axis in self.translations.T]
        rotations, translations = slerp(when).as_matrix(), np.stack(moved, axis=1)
        rotations[known], translations[known] = self.rotations[known], self.translations[known]
        return RigidMotion(rotations, translations)

    @property
    def matrices(self) -> FloatArray:
        """Homogeneous matrices, (T, 4, 4)."""
        result = np.tile(np.eye(4), (len(self), 1, 1))
        result[:, :3, :3], result[:, :3, 3] = self.rotations, self.translations
        return result

    @property
    def degrees(self) -> FloatArray:
        """Angle of each rotation, (T,)."""
        return np.asarray(np.degrees(Rotation.from_matrix(self.rotations).magnitude()))

    def __len__(self) -> int:
        """Number of frames T."""
        return len(self.rotations)


def align(
    shape: FloatArray, points: FloatArray, weights: FloatArray, pull: float = 0.0
) -> RigidMotion:
    """The motion of each frame that takes a shape nearest to points, by weighted least squares.

    Parameters
    ----------
    shape : array, shape (m, 3)
    points : array, shape (T, m, 3)
        What has no weight may be NaN.
    weights : array, shape (T, m)
        Not negative; with all zero, the motion means nothing.
    pull : float
        Towards no rotation, relative to the spread of the shape: decides where its points are too
        few, or lie on a line.
    """
    share = weights / np.maximum(weights.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    seen = np.where(weights[:, :, None] > 0, points, 0.0)
    rest, centre = share @ shape, np.einsum("tm,tmi->ti", share, seen)
    arms = seen - centre[:, None]
    covariance = (arms * share[:, :, None]).transpose(0, 2, 1) @ shape
    covariance -= np.einsum("tm,tmi,tj->tij", share, arms, rest)
    if pull:
        spread = np.einsum("tm,tmi->t", share, (shape - rest[:, None]) ** 2)
        towards = np.where(spread > 0.0, pull * spread, 1.0)
        covariance += towards[:, None, None] * np.eye(3)
    U, _, Vt = np.linalg.svd(covariance)
    turn = np.ones_like(centre)
    turn[:, 2] = np.sign(np.linalg.det(U @ Vt))  # a rotation, never a mirror
    rotations = np.asarray((U * turn[:, None, :]) @ Vt)
    return RigidMotion(rotations, centre - np.einsum("tij,tj->ti", rotations, rest))


def determined(shape: FloatArray, seen: BoolArray) -> BoolArray:
    """Mask of frames whose seen points (T, m) of a shape (m, 3) fix a rotation, (T,).

    Three do that are not on a line.
    """
    count = np.maximum(seen.sum(axis=1), 1)[:, None]
    centre = seen @ shape / count
    scatter = np.einsum("tm,mi,mj->tij", seen.astype(np.float64), shape, shape)
    scatter -= count[:, :, None] * centre[:, :, None] * centre[:, None, :]
    across = np.linalg.eigvalsh(scatter)[:, 1]
    whole = float(np.sum((shape - shape.mean(axis=0)) ** 2))
    return np.asarray((seen.sum(axis=1) >= 3) & (across > FLAT**2 * whole))


def mean_motion(motion: RigidMotion) -> RigidMotion:
    """Mean of the motions of all frames, as a single frame."""
    rotation = Rotation.from_matrix(motion.rotations).mean().as_matrix()
    return RigidMotion(rotation[None], motion.translations.mean(axis=0, keepdims=True))
