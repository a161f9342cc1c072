"""Small geometry of triangle meshes."""

from __future__ import annotations

import numpy as np

from facert.data.arrays import FloatArray, IntArray


def vertex_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Smooth unit normals (V, 3): the mean over the triangles at a vertex, by area.

    A vertex without a triangle, or with flat ones only, has the normal 0.
    """
    first, second, third = (vertices[corner].T for corner in faces.T)
    ux, uy, uz = second - first
    vx, vy, vz = third - first
    corners, count = faces.ravel(), len(vertices)
    total = np.stack(
        [
            np.bincount(corners, np.repeat(part, 3), count)
            for part in (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
        ],
        axis=1,
    )
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))
