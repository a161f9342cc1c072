"""The face and the performance that every program writes, and how far a reading is off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from facert import Rig, Take
from facert.data.arrays import FloatArray, IntArray
from facert.data.names import match

NAMES = ("jawOpen", "mouthSmileLeft", "mouthSmileRight", "browInnerUp")
FRAMES, FPS = 72, 24.0
TIME = np.arange(FRAMES) / FPS
RINGS, SIDES = 9, 12


def _grid() -> tuple[FloatArray, IntArray]:
    """A head of 0.16 x 0.22 x 0.18 m around (0, 1.6, 0), y up, and its triangles."""
    ring, side = np.meshgrid(np.arange(RINGS), np.arange(SIDES), indexing="ij")
    height, turn = np.pi * (ring + 0.7) / (RINGS + 0.4), 2 * np.pi * side / SIDES
    points = [0.08 * np.sin(height) * np.sin(turn), 1.6 + 0.11 * np.cos(height)]
    points.append(0.09 * np.sin(height) * np.cos(turn) * (1.0 + 0.05 * np.sin(height)))
    a = (ring * SIDES + side)[:-1].ravel()
    b = (ring * SIDES + (side + 1) % SIDES)[:-1].ravel()
    faces = np.concatenate([np.c_[a, a + SIDES, b], np.c_[b, a + SIDES, b + SIDES]])
    return np.stack(points, axis=-1).reshape(-1, 3), faces


def _shapes(vertices: FloatArray) -> FloatArray:
    """Displacements (P, V, 3) of up to 3 cm, each of a part of the face."""
    centres = np.array([[0, 1.53, 0.08], [0.04, 1.57, 0.07], [-0.04, 1.57, 0.07], [0, 1.66, 0.07]])
    ways = np.array([[0, -0.03, -0.01], [0.01, 0.01, 0], [-0.01, 0.01, 0], [0, 0.012, 0.002]])
    near = np.exp(-(((vertices - centres[:, None]) / 0.04) ** 2).sum(axis=2))
    return np.where(near > 0.05, near, 0.0)[:, :, None] * ways[:, None]


VERTICES, FACES = _grid()
SHAPES = _shapes(VERTICES)
FACE = Rig(VERTICES, SHAPES, NAMES, FACES, "m")

_SPEEDS, _PHASES = np.array([0.7, 1.1, 1.3, 0.4]), np.array([0.1, 0.3, 0.45, 0.8])
WEIGHTS = np.round(0.5 + 0.45 * np.sin(2 * np.pi * (TIME[:, None] * _SPEEDS + _PHASES)), 6)
"""Weights (T, P) of the performance, as exact as six digits."""

MARKERS = ("LBROW", "RBROW", "CHIN", "LLIP", "RLIP")
POSITIONS = np.round(
    1000 * (VERTICES[[16, 22, 74, 61, 65]] + np.einsum("tp,pmd->tmd", WEIGHTS, SHAPES[:, :5])), 3
)
"""Positions of markers (T, M, 3) in mm."""


def rig_difference(rig: Rig, vertices: FloatArray, shapes: Mapping[str, FloatArray]) -> float:
    """The largest distance between vertices, at rest and at each shape, in any order of vertices.

    Raises `ValueError` for a shape that the rig has not, or one too many.
    """
    if len(rig.names) != len(shapes):
        raise ValueError(f"shapes {', '.join(rig.names)}")
    order = match(tuple(shapes), rig.names, "/names")
    theirs = np.stack([vertices, *(vertices + shape for shape in shapes.values())], axis=1)
    ours = np.stack([rig.neutral, *(rig.neutral + rig.shapes[order])], axis=1)
    pair = [each.reshape(len(each), -1) for each in (ours, theirs)]
    distances = [cKDTree(a).query(b)[0].max() for a, b in (pair, pair[::-1])]
    return float(max(distances))


def weights_difference(take: Take, time: FloatArray, weights: FloatArray) -> float:
    """The largest difference of a weight of `NAMES` at its time; whole seconds count as much.

    Raises `ValueError` when the take has another number of frames or weights.
    """
    if take.source.values.shape != weights.shape:
        raise ValueError(f"{len(take)} frames of {', '.join(take.source.names)}")
    order = match(NAMES, take.source.names, "/source/names")
    late = np.abs(take.time - take.time[0] - (time - time[0])).max()
    return float(max(late, np.nanmax(np.abs(take.source.values[:, order] - weights))))


def markers_difference(take: Take, positions: FloatArray, fps: float) -> float:
    """The largest difference of a marker's coordinate, where both have one, or the rate's share.

    Raises `ValueError` for other markers, or other ones hidden.
    """
    if take.source.names != MARKERS or take.source.kind != "markers":
        raise ValueError(f"{take.source.kind} {', '.join(take.source.names)}")
    values = take.source.values
    if values.shape != positions.shape or (np.isnan(values) != np.isnan(positions)).any():
        raise ValueError(f"{np.isnan(values).sum()} of {values.size} numbers are hidden")
    return float(max(np.nanmax(np.abs(values - positions)), abs(take.fps / fps - 1)))
