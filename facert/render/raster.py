"""Triangles to pixels: a z-buffer in numpy, as many triangles at once as memory should hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.errors import InputError

MAX_LAYERS = 32
"""So often triangles may cover the whole picture: a head with eyes, teeth and hair does 4 times."""
_BATCH = 2**20  # pixels that triangles drawn at once may cover
_HAIR = 1e-9  # pixels, and weights
_FAR = 1e9
_Pair = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Surface:
    """The nearest surface in each pixel; n pixels show the mesh, in the order of the image."""

    covered: BoolArray
    """Rows from top to bottom, (H, W)."""
    depth: FloatArray
    """Distance towards the viewer, in the mesh's unit, (n,)."""
    normal: FloatArray
    """Unit normals, turned towards the viewer, (3, n)."""
    colour: FloatArray
    """RGB of the mesh, (3, n)."""
    inside: BoolArray
    """The pixel sees the back of a triangle, (n,)."""


@dataclass(frozen=True, eq=False)
class _Hits:
    """Pixels that lie in triangles: the triangle, the pixel, and two barycentric weights."""

    face: IntArray
    pixel: IntArray
    first: FloatArray
    second: FloatArray

    def __getitem__(self, chosen: BoolArray | IntArray) -> _Hits:
        return _Hits(self.face[chosen], self.pixel[chosen], self.first[chosen], self.second[chosen])

    def interpolate(self, corners: FloatArray) -> FloatArray:
        """Values (n,) at the pixels, from those at the triangles' corners (3, F)."""
        a, b, c = corners[:, self.face]
        return np.asarray(c + self.first * (a - c) + self.second * (b - c))


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
    corners = np.ascontiguousarray(pixels.T)[:, faces.T]  # (column, row or depth; corner; F)
    area = _area(corners)
    hits, depth = _nearest_of_all(corners, area, size)
    covered = np.zeros(size * size, dtype=bool)
    covered[hits.pixel] = True
    inside = area[hits.face] > 0  # rows grow downwards: anticlockwise triangles have area < 0
    normal = np.stack([hits.interpolate(part[faces.T]) for part in normals.T])
    normal *= np.where(inside, -1, 1) / np.maximum(np.sqrt((normal**2).sum(axis=0)), 1e-12)
    return Surface(
        covered.reshape(size, size),
        depth,
        normal,
        np.stack([hits.interpolate(part[faces.T]) for part in colours.T]),
        inside,
    )


def _area(corners: FloatArray) -> FloatArray:
    """Twice the area of each triangle on the picture, with its sign; 0 for a mere line."""
    (ax, bx, cx), (ay, by, cy), _ = corners
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return np.where(np.abs(area) < _HAIR, 0, area)


def _nearest_of_all(corners: FloatArray, area: FloatArray, size: int) -> tuple[_Hits, FloatArray]:
    """Nearest hit of each pixel to the viewer, in the order of the image, and its depth."""
    front = np.full(size * size, -np.inf)
    face = np.full(size * size, -1)
    weights = np.zeros((2, size * size))
    for part in _batches(corners, area, size):
        hits = _hits(corners[:, :, part], area[part], size)
        hits, depth = _nearest(hits, hits.interpolate(corners[2][:, part]), size)
        nearer = depth >= front[hits.pixel]
        hits, depth = hits[nearer], depth[nearer]
        front[hits.pixel], face[hits.pixel] = depth, hits.face + part.start
        weights[:, hits.pixel] = hits.first, hits.second
    shown = np.flatnonzero(face >= 0)
    return _Hits(face[shown], shown, *weights[:, shown]), front[shown]


def _batches(corners: FloatArray, area: FloatArray, size: int) -> Iterator[slice]:
    """Iterate over triangles that are drawn at once, by how many pixels they may cover.

    Raises `InputError` for triangles that cover the picture more often than a face's.
    """
    wide, high = (
        np.clip(part.max(axis=0), -1, size) - np.clip(part.min(axis=0), -1, size) + 1
        for part in corners[:2]
    )
    most = np.where(area == 0, 0, np.minimum(wide * high, np.abs(area) / 2 + wide + high))
    covered = np.cumsum(np.nan_to_num(most))
    if len(most) and covered[-1] > MAX_LAYERS * size**2 + 9 * len(most):
        found = f"{covered[-1] / size**2:.0f} layers of triangles"
        fix = "Merge what lies in the same place, or leave it out."
        raise InputError("faces", f"at most {MAX_LAYERS} above each other", found, fix)
    start = 0
    while start < len(most):
        reached = covered[start - 1] if start else 0.0
        stop = max(start + 1, int(np.searchsorted(covered, reached + _BATCH)))
        yield slice(start, stop)
        start = stop


def _hits(corners: FloatArray, area: FloatArray, size: int) -> _Hits:
    """Pixels of each triangle, line by line.

    On a line of pixels the three barycentric weights are linear in the column, so that the
    columns where all of them are positive are one span.
    """
    face, row = _lines(corners, size, area)
    (ax, bx, cx), (ay, by, cy), _ = corners
    inverse = 1 / np.where(area == 0, 1, area)
    y = row - cy[face]  # from the third corner
    slopes = ((by - cy) * inverse)[face], ((cy - ay) * inverse)[face]
    starts = y * ((cx - bx) * inverse)[face], y * ((ax - cx) * inverse)[face]
    low, high = _span(slopes, starts)
    left = np.clip(np.ceil(low + cx[face]), 0, size).astype(np.int64)
    right = np.clip(np.floor(high + cx[face]), -1, size - 1).astype(np.int64)
    count = np.maximum(right - left + 1, 0)
    line = np.repeat(np.arange(len(face)), count)
    column = left[line] + _counted(count)
    face, row = face[line], row[line]
    x = column - cx[face]
    weights = (start[line] + x * slope[line] for start, slope in zip(starts, slopes, strict=True))
    first, second = (np.clip(weight, 0, 1) for weight in weights)
    np.minimum(second, 1 - first, out=second)  # by that hair, a sliver would reach far beyond
    return _Hits(face, row * size + column, first, second)


def _lines(corners: FloatArray, size: int, area: FloatArray) -> tuple[IntArray, IntArray]:
    """Lines of pixels that triangles reach: index of the triangle, and row."""
    low = np.clip(np.ceil(corners[1].min(axis=0)), 0, size).astype(np.int64)
    high = np.clip(np.floor(corners[1].max(axis=0)) + 1, 0, size).astype(np.int64)
    height = np.where(area == 0, 0, np.maximum(high - low, 0))
    face = np.repeat(np.arange(len(height)), height)
    return face, low[face] + _counted(height)


def _span(slopes: _Pair, starts: _Pair) -> _Pair:
    """Span of each line where the weights s + x m of all three corners are not negative.

    A hair wider, so that no pixel on the edge of two triangles falls between them.
    """
    low, high = np.full(len(slopes[0]), -_FAR), np.full(len(slopes[0]), _FAR)
    third = -slopes[0] - slopes[1], 1 - starts[0] - starts[1]
    for slope, start in (*zip(slopes, starts, strict=True), third):
        level = np.abs(slope) < _HAIR
        zero = -start / np.where(level, 1, slope)
        np.maximum(low, zero, out=low, where=slope >= _HAIR)
        np.minimum(high, zero, out=high, where=slope <= -_HAIR)
        low[level & (start < -_HAIR)] = _FAR
    return low - _HAIR, high + _HAIR


def _counted(lengths: IntArray) -> IntArray:
    """Counts 0, 1, ... up to each length, one after the other."""
    ends = np.cumsum(lengths)
    return np.asarray(np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - lengths, lengths))


def _nearest(hits: _Hits, depth: FloatArray, size: int) -> tuple[_Hits, FloatArray]:
    """Nearest hit of each pixel to the viewer, in the order of the image."""
    front = np.full(size * size, -np.inf)
    np.maximum.at(front, hits.pixel, depth)
    shown = np.full(size * size, -1)
    candidates = np.flatnonzero(depth == front[hits.pixel])
    shown[hits.pixel[candidates]] = candidates
    shown = shown[shown >= 0]
    return hits[shown], depth[shown]
