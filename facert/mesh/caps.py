"""Caps for the holes of a face mesh: eyes and a mouth that were cut out.

A boundary is a hole where it is short beside the piece of mesh that it is in; otherwise it is an
outline, as that of a mask, a neck or an eyelash.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from facert.data.arrays import FloatArray, IntArray

LONGEST = 0.75
"""Length of a hole's boundary in diagonals of its piece of mesh; an outline has at least 1."""


@dataclass(frozen=True, eq=False)
class Caps:
    """Triangles that close the holes of a mesh, each hole by a fan about its middle."""

    edges: IntArray
    """Around the holes, wound as the caps are, (E, 2)."""
    hole: IntArray
    """Which hole each edge is of, from 0, (E,)."""

    def faces(self, count: int) -> IntArray:
        """Triangles (E, 3), of a mesh of `count` vertices and the middles behind them."""
        return np.column_stack([self.edges, count + self.hole])

    def middles(self, vertices: FloatArray) -> FloatArray:
        """The middle of each hole, (H, 3), with these vertices (V, 3)."""
        sums = _summed(vertices[self.edges].mean(axis=1), self.hole)
        return sums / np.bincount(self.hole)[:, None]


def caps_of(vertices: FloatArray, faces: IntArray) -> Caps:
    """The caps of a mesh (V, 3) with triangles (F, 3); vertices at one place count as one."""
    _, first, place = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    welded = first[place.ravel()][faces]
    directed = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    _, edge, count = np.unique(
        np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    border = (count[edge.ravel()] == 1) & (directed[:, 0] != directed[:, 1])
    edges = directed[border][:, ::-1]
    loop = _connected(edges, len(vertices))[edges[:, 0]]
    steps = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    piece = _connected(directed, len(vertices))
    short = np.bincount(loop, steps)[loop] < LONGEST * _diagonals(vertices, piece)[edges[:, 0]]
    _, hole = np.unique(loop[short], return_inverse=True)
    return Caps(edges[short], hole.ravel().astype(np.int64))


def _connected(edges: IntArray, count: int) -> IntArray:
    """The piece, from 0, that edges (E, 2) make each of so many vertices part of, (V,)."""
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _diagonals(vertices: FloatArray, piece: IntArray) -> FloatArray:
    """Diagonal of the box about the piece of each vertex, (V,)."""
    order = np.argsort(piece, kind="stable")
    starts = np.flatnonzero(np.diff(piece[order], prepend=-1))
    high, low = (end.reduceat(vertices[order], starts) for end in (np.maximum, np.minimum))
    return np.asarray(np.linalg.norm(high - low, axis=1)[piece])


def _summed(vectors: FloatArray, loop: IntArray) -> FloatArray:
    """Sums of vectors (n, 3) by their loops, from 0, (L, 3)."""
    return np.stack([np.bincount(loop, part) for part in vectors.T], axis=1)
