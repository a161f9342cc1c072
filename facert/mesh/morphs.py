"""A mesh in motion as morph targets: vertices(t) = neutral + sum_k weights_k(t) * targets_k.

A rig has its targets: its shapes. The frames of a dense sequence, displacements D (T, 3V) from the
neutral, get a compact basis by a randomised range finder (Halko, Martinsson and Tropp, SIAM Review
53, 2011): Q is an orthonormal basis of random mixtures of the frames, large enough that no vertex
of D - (D Q) Q' is off by more than the tolerance. Of the singular vectors of the small matrix D Q,
those that move no vertex far are dropped, as many as the tolerance allows. Frames are read in
batches, so that memory does not grow with their number.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.rig import Mesh, MeshSequence, Rig
from facert.errors import InputError

TOLERANCE = 5e-3  # a fifth of a millimetre where a jaw opens by four centimetres
_FIRST_SIZE = 64


@dataclass(frozen=True, eq=False)
class Morphs:
    """A mesh moved by weighted targets."""

    neutral: Mesh
    targets: FloatArray
    """Displacement of every vertex when a weight is 1, (K, V, 3)."""
    names: tuple[str, ...]
    weights: FloatArray  # (T, K)
    time: FloatArray
    """Seconds, (T,)."""
    error: float = 0.0
    """The targets miss no vertex of the original by more, in the neutral's units."""
    fps: float = 30.0
    """Nominal frames a second."""


def rig_morphs(rig: Rig, params: FloatArray, time: FloatArray, fps: float = 30.0) -> Morphs:
    """A rig's own shapes, also those that stay at 0.

    Rows of NaN in `params` (T, P), frames without a pose, are left out.

    Raises `InputError` when no frame has a pose.
    """
    posed = ~np.isnan(params).any(axis=1)
    if not posed.any():
        raise InputError("/target/params", "a pose", "none", "Retarget the take first.")
    return Morphs(rig.mesh, rig.shapes, rig.names, params[posed], time[posed], fps=fps)


def moving_morphs(morphs: Morphs) -> Morphs:
    """Those targets that move something, at some time; the first where none does."""
    used = np.any(morphs.weights != 0, axis=0) & morphs.targets.any(axis=(1, 2))
    moving = np.flatnonzero(used)
    moving = moving if len(moving) else np.arange(1)
    names = tuple(morphs.names[index] for index in moving)
    weights, targets = morphs.weights[:, moving], morphs.targets[moving]
    return replace(morphs, targets=targets, names=names, weights=weights)


def compact_morphs(sequence: MeshSequence, tolerance: float = TOLERANCE, seed: int = 0) -> Morphs:
    """A few targets that move a mesh as a dense sequence does, every frame of which is finite.

    `tolerance` is how far a vertex of any frame may be off, as a share of the largest displacement
    of a vertex in the sequence; `seed` is for the random mixtures.
    """
    most = min(len(sequence), sequence.neutral.vertices.size)  # there are no more directions
    size = min(_FIRST_SIZE, most)
    while True:
        mixtures, motion = _mix(sequence, size, seed)
        basis, _ = np.linalg.qr(mixtures.T)  # (3V, size)
        weights, missed = _project(sequence, basis)
        if missed <= 0.5 * tolerance * motion or size == most:
            break
        size = min(2 * size, most)
    weights, basis = _directions(weights, basis)
    count, dropped = _fewest(weights, basis, tolerance * motion - missed, sequence.batch)
    return _scaled(sequence, weights[:, :count], basis[:, :count], missed + dropped)


def _displacements(sequence: MeshSequence) -> Iterator[tuple[slice, FloatArray]]:
    """The frames' rows and displacements (n, 3V), a batch at a time."""
    start = 0
    for vertices in sequence.batches():
        moved = (vertices - sequence.neutral.vertices).reshape(len(vertices), -1)
        yield slice(start, start + len(moved)), moved
        start += len(moved)


def _mix(sequence: MeshSequence, size: int, seed: int) -> tuple[FloatArray, float]:
    """Random mixtures (size, 3V) of the frames, and the largest displacement of a vertex."""
    frames = len(sequence)
    rng = np.random.default_rng(seed)
    mixing = rng.normal(size=(frames, size)) if size < frames else np.eye(frames)
    mixtures, motion = np.zeros((size, sequence.neutral.vertices.size)), 0.0
    for rows, moved in _displacements(sequence):
        mixtures += mixing[rows].T @ moved
        motion = max(motion, _largest(moved))
    return mixtures, motion


def _project(sequence: MeshSequence, basis: FloatArray) -> tuple[FloatArray, float]:
    """Weights (T, size) of an orthonormal basis, and how far off it leaves a vertex at most."""
    weights, missed = np.empty((len(sequence), basis.shape[1])), 0.0
    for rows, moved in _displacements(sequence):
        weights[rows] = moved @ basis
        moved -= weights[rows] @ basis.T
        missed = max(missed, _largest(moved))
    return weights, missed


def _directions(weights: FloatArray, basis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights (T, K) and basis (3V, K) in singular directions, the farthest reaching first.

    By reach, not by singular value: a blink in a single frame is to be seen.
    """
    left, strength, right = np.linalg.svd(weights, full_matrices=False)
    weights, basis = left * strength, basis @ right.T
    lengths = np.sum(basis.reshape(-1, 3, basis.shape[1]) ** 2, axis=1).max(axis=0)
    order = np.argsort(-np.abs(weights).max(axis=0) * np.sqrt(lengths))
    return weights[:, order], basis[:, order]


def _fewest(
    weights: FloatArray, basis: FloatArray, allowed: float, batch: int
) -> tuple[int, float]:
    """Fewest leading directions within the allowed error, and a vertex's largest error then."""
    too_few, enough, error = 0, weights.shape[1], 0.0
    while enough - too_few > 1:
        middle = (too_few + enough) // 2
        off = _dropped(weights[:, middle:], basis[:, middle:], allowed, batch)
        if off <= allowed:
            enough, error = middle, off
        else:
            too_few = middle
    return enough, error


def _dropped(weights: FloatArray, basis: FloatArray, allowed: float, batch: int) -> float:
    """Largest error of a vertex without these directions, or the first one above `allowed`."""
    order = np.argsort(-np.sum(weights**2, axis=1))  # what is too far shows early
    farthest = 0.0
    for start in range(0, len(weights), batch):
        farthest = max(farthest, _largest(weights[order[start : start + batch]] @ basis.T))
        if farthest > allowed:
            break
    return farthest


def _scaled(sequence: MeshSequence, weights: FloatArray, basis: FloatArray, error: float) -> Morphs:
    """Morphs whose weights run to 1 at most, with the sign of their strongest value."""
    strongest = np.abs(weights).argmax(axis=0)
    scale = weights[strongest, np.arange(weights.shape[1])]
    scale = np.where(scale == 0, 1.0, scale)
    targets = (basis * scale).T.reshape(-1, *sequence.neutral.vertices.shape)
    names = tuple(f"motion{index}" for index in range(1, len(targets) + 1))
    weights = weights / scale
    return Morphs(sequence.neutral, targets, names, weights, sequence.time, error, sequence.fps)


def _largest(moved: FloatArray) -> float:
    """The longest displacement of a vertex in displacements (n, 3V)."""
    vectors = moved.reshape(-1, 3)
    return float(np.sqrt(np.einsum("vc,vc->v", vectors, vectors).max()))
