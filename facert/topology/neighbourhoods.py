"""Neighbourhoods: which points make up the local structure X_i of each point (section 3.1.1).

A neighbourhood is a list of indices l_i into the points. Frames of a take have windows of time
(section 3.2, Figure 2); vertices of a mesh have rings of edges (section 3.3, Figure 4). Nearness in
space is not offered: on a face it bridges the lips.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from facert.data.arrays import IntArray
from facert.errors import InputError


@dataclass(frozen=True, eq=False)
class Neighbourhoods:
    """The index lists l_i of all neighbourhoods, one after the other."""

    points: int  # N, how many points they choose from
    members: IntArray  # (sum of sizes,): Indices of points
    sizes: IntArray  # k_i, how many of the members, all different, belong to each neighbourhood

    def by_size(self) -> Iterator[IntArray]:
        """The neighbourhoods of each size k together, (n_k, k)."""
        starts = np.cumsum(self.sizes) - self.sizes
        for size in np.unique(self.sizes):
            first = starts[self.sizes == size]
            yield self.members[first[:, None] + np.arange(size)]

    @cached_property
    def components(self) -> IntArray:
        """Number of the connected component that each point belongs to, (N,).

        Points are connected when they share a neighbourhood: nothing else carries a label to them.
        """
        first = self.members[np.cumsum(self.sizes) - self.sizes]
        edges = (np.ones(len(self.members)), (np.repeat(first, self.sizes), self.members))
        graph = sparse.coo_array(edges, shape=(self.points, self.points)).tocsr()
        _, numbers = connected_components(graph, directed=False)
        return np.asarray(numbers, dtype=np.int64)


def temporal_windows(frames: int, width: int) -> Neighbourhoods:
    """Neighbourhoods of the `width` frames around each, fewer at both ends (Figure 2).

    Parameters
    ----------
    frames : int
        T.
    width : int
        k, odd, at least 3.

    Raises
    ------
    InputError
        For another width.
    """
    if width < 3 or width % 2 == 0:
        raise InputError("window", "an odd number, 3 or more", f"{width}", "For instance 15.")
    reach = width // 2
    window = np.arange(frames)[:, None] + np.arange(-reach, reach + 1)
    inside = (window >= 0) & (window < frames)
    return Neighbourhoods(frames, window[inside], inside.sum(axis=1))


def mesh_rings(faces: IntArray, vertices: int) -> Neighbourhoods:
    """Neighbourhoods of each vertex with its neighbours along edges (Figure 4).

    Any triangles will do: edges of three faces, doubled and degenerate faces do no harm. A vertex
    that no face uses is alone.

    Parameters
    ----------
    faces : array of int, shape (F, 3)
    vertices : int
        V.
    """
    reach = (adjacency(faces, vertices) + sparse.eye_array(vertices)).tocsr()
    reach.sort_indices()
    return Neighbourhoods(vertices, reach.indices.astype(np.int64), np.diff(reach.indptr))


def adjacency(faces: IntArray, vertices: int) -> sparse.csr_array:
    """Adjacency matrix: 1 where an edge joins two vertices, (V, V).

    Raises
    ------
    InputError
        When a face uses a vertex that does not exist.
    """
    if faces.size and not (0 <= faces.min() and faces.max() < vertices):
        raise InputError(
            "/faces",
            f"vertices from 0 to {vertices - 1}",
            f"{faces.min()} to {faces.max()}",
            "Check the export.",
        )
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    different = start != end
    rows = np.concatenate([start[different], end[different]])
    columns = np.concatenate([end[different], start[different]])
    edges = sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(vertices, vertices))
    joined = edges.tocsr()  # sums what is doubled
    joined.data[:] = 1.0
    return joined
