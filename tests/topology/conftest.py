"""Small faces and motions."""

from __future__ import annotations

import numpy as np
import pytest

from facert.data.arrays import FloatArray, IntArray


def grid_mesh(rows: int = 9, columns: int = 8, seed: int = 0) -> tuple[FloatArray, IntArray]:
    """A curved sheet of triangles, its vertices a little out of line."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0.0:rows, 0.0:columns]
    points = np.stack([x, y, 0.1 * (x - 3) ** 2 - 0.05 * x * y], axis=2).reshape(-1, 3)
    points += 0.05 * rng.normal(size=points.shape)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + columns], axis=1)
    upper = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    return points, np.concatenate([lower, upper])


def two_meshes() -> tuple[FloatArray, IntArray]:
    """Two sheets, the second some way above the first."""
    points, faces = grid_mesh()
    above, _ = grid_mesh(seed=1)
    return np.concatenate([points, above + np.array([0, 0, 9.0])]), np.concatenate(
        [faces, faces + 72]
    )


def rotation(seed: int = 0) -> FloatArray:
    """A random rotation."""
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(Q * np.sign(np.linalg.det(Q)))


@pytest.fixture
def sheet() -> tuple[FloatArray, IntArray]:
    """Vertices (72, 3) and triangles."""
    return grid_mesh()


@pytest.fixture
def two_sheets() -> tuple[FloatArray, IntArray]:
    """Vertices (144, 3) in two connected components, and triangles."""
    return two_meshes()


@pytest.fixture
def turn() -> FloatArray:
    """A rotation (3, 3)."""
    return rotation()
