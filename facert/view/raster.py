"""Triangles to pixels: a z-buffer in numpy, all triangles at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Surface:
    """What each pixel sees, rows from top to bottom.

    Attributes
    ----------
    covered : array of bool, shape (H, W)
    depth : array, shape (H, W)
        Distance towards the viewer, in the mesh's unit.
    normal : array, shape (H, W, 3)
        Unit normals, turned towards the viewer.
    colour : array, shape (H, W, 3)
    inside : array of bool, shape (H, W)
        The pixel sees the back of a triangle.
    """

    covered: BoolArray
    depth: FloatArray
    normal: FloatArray
    colour: FloatArray
    inside: BoolArray


def rasterise(
    pixels: FloatArray, normals: FloatArray, colours: FloatArray, faces: IntArray, size: int
) -> Surface:
    """Draw triangles on a square of pixels.

    Parameters
    ----------
    pixels : array, shape (V, 3)
        Column, row and depth of each vertex; greater depth is nearer to the viewer.
    normals, colours : array, shape (V, 3)
    faces : array of int, shape (F, 3)
    size : int
        Pixels a side.
    """
    face, row, column = _candidates(pixels[faces], size)
    weights, inside = _barycentric(pixels[faces[face]], row, column)
    hit = (weights >= 0).all(axis=1)
    face, weights, inside = face[hit], weights[hit], inside[hit]
    pixel = row[hit] * size + column[hit]
    depth = (weights * pixels[faces[face], 2]).sum(axis=1)
    nearest_last = np.argsort(depth, kind="stable")
    nearest = np.full(size * size, -1)
    nearest[pixel[nearest_last]] = nearest_last
    covered = nearest >= 0
    seen = nearest[covered]
    corners, weights = faces[face[seen]], weights[seen][..., None]

    def image(values: FloatArray) -> FloatArray:
        flat = np.zeros((size * size, *values.shape[1:]))
        flat[covered] = values
        return flat.reshape(size, size, *values.shape[1:])

    normal = (weights * normals[corners]).sum(axis=1)
    normal *= np.where(inside[seen], -1, 1)[:, None]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return Surface(
        covered.reshape(size, size),
        image(depth[seen]),
        image(normal),
        image((weights * colours[corners]).sum(axis=1)),
        image(inside[seen].astype(float)) > 0,
    )


def vertex_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Smooth unit normals (V, 3): the mean over the triangles at a vertex, by area."""
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(vertices)
    np.add.at(total, faces.ravel(), np.repeat(normal, 3, axis=0))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def _candidates(corners: FloatArray, size: int) -> tuple[IntArray, IntArray, IntArray]:
    """Every pixel of every triangle's bounding box: index of the triangle, row, column."""
    low = np.clip(np.ceil(corners[..., :2].min(axis=1)), 0, size).astype(np.int64)
    high = np.clip(np.floor(corners[..., :2].max(axis=1)) + 1, 0, size).astype(np.int64)
    width, height = np.maximum(high - low, 0).T
    count = width * height
    face = np.repeat(np.arange(len(corners)), count)
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row = low[face, 1] + place // width[face]
    column = low[face, 0] + place % width[face]
    return face, row, column


def _barycentric(
    corners: FloatArray, row: IntArray, column: IntArray
) -> tuple[FloatArray, BoolArray]:
    """Weights of the corners (n, 3) at each pixel, and whether the triangle shows its back."""
    (ax, ay), (bx, by), (cx, cy) = np.moveaxis(corners[..., :2], (1, 2), (0, 1))
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    safe = np.where(area == 0, np.inf, area)
    first = ((bx - column) * (cy - row) - (by - row) * (cx - column)) / safe
    second = ((cx - column) * (ay - row) - (cy - row) * (ax - column)) / safe
    weights = np.column_stack([first, second, 1 - first - second])
    weights[area == 0] = -1
    return weights, area > 0  # rows grow downwards, so anticlockwise triangles have area < 0
