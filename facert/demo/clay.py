"""The skin of a head as the zero of a field: ellipsoids joined by soft seams."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facert.data.arrays import FloatArray
from facert.demo.build import Blob

ORIGIN = np.array([0.0, 1.0, 0.0])  # inside of the head; every point of the skin is seen from here
FORWARD = np.array([0.0, -0.36, 0.933])  # from there to the tip of the nose
_FAR = 40.0
_BISECTIONS = 48  # 40 cm / 2^48: as fine as float64 allows


def field(points: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """Roughly the distance to the skin (...,) of points (..., 3): negative inside.

    The head is symmetric, so blobs are given for the left side only.
    """
    points = np.concatenate([np.abs(points[..., :1]), points[..., 1:]], axis=-1)
    distance = _ellipsoid(points, blobs[0])
    for blob in blobs[1:]:
        other = _ellipsoid(points, blob)
        if blob.dig:
            distance = -_soft_minimum(-distance, other, blob.blend)
        else:
            distance = _soft_minimum(distance, other, blob.blend)
    return distance


def cast_from_inside(directions: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """Where rays from the head's inside leave the skin, (n, 3) for unit directions (n, 3)."""
    return _bisect(np.broadcast_to(ORIGIN, directions.shape), ORIGIN + _FAR * directions, blobs)


def cast_from_front(points: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """The skin behind the points (n, 2) of the front view, (n, 3)."""
    inside = np.column_stack([points, np.zeros(len(points))])
    return _bisect(inside, inside + np.array([0.0, 0.0, _FAR]), blobs)


def _bisect(inside: FloatArray, outside: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """The zero of the field between points inside and outside of the head."""
    for _ in range(_BISECTIONS):
        middle = (inside + outside) / 2
        out = field(middle, blobs)[:, None] > 0
        inside, outside = np.where(out, inside, middle), np.where(out, middle, outside)
    return (inside + outside) / 2


def _ellipsoid(points: FloatArray, blob: Blob) -> FloatArray:
    scaled = (points - blob.centre) / blob.radii
    radius = np.linalg.norm(scaled, axis=-1)
    slope = np.linalg.norm(scaled / blob.radii, axis=-1)
    return np.asarray(radius * (radius - 1) / np.maximum(slope, 1e-9))


def _soft_minimum(a: FloatArray, b: FloatArray, blend: float) -> FloatArray:
    overlap = np.maximum(blend - np.abs(a - b), 0) / blend
    return np.asarray(np.minimum(a, b) - overlap**2 * blend / 4)
