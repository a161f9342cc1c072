"""Neighbourhoods: which points make up the local structure X_i of each point (section 3.1.1).

A neighbourhood is a list of indices l_i into the points. Frames of a take have windows of time
(section 3.2, Figure 2); vertices of a mesh have rings of edges (section 3.3, Figure 4). Nearness in
space is not offered: on a face it bridges the lips.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from facert.data.arrays import IntArray
from facert.errors import InputError


@dataclass(frozen=True, eq=False)
class Neighbourhoods:
    """The index lists l_i of all neighbourhoods, one after the other.

    Parameters
    ----------
    points : int
        N, how many points they choose from.
    members : array of int, shape (sum of sizes,)
        Indices of points.
    sizes : array of int
        k_i, how many of the members belong to each neighbourhood.

    Raises
    ------
    InputError
        When a neighbourhood is empty, names a point twice, or names one that does not exist.
    """

    points: int
    members: IntArray
    sizes: IntArray

    def __post_init__(self) -> None:
        bad = (self.members < 0) | (self.members >= self.points)
        if bad.any():
            found = f"{self.members[bad][0]}"
            raise _bad(f"points from 0 to {self.points - 1}", found)
        if (self.sizes < 1).any():
            raise _bad("at least one point each", "an empty one")
        order = np.lexsort((self.members, self.owners))
        same = (np.diff(self.members[order]) == 0) & (np.diff(self.owners[order]) == 0)
        if same.any():
            raise _bad("different points in each", f"{self.members[order][1:][same][0]} twice")

    @cached_property
    def owners(self) -> IntArray:
        """For each member, the number of its neighbourhood."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes)

    def by_size(self) -> Iterator[IntArray]:
        """The neighbourhoods of each size k together, (n_k, k)."""
        starts = np.cumsum(self.sizes) - self.sizes
        for size in np.unique(self.sizes):
            first = starts[self.sizes == size]
            yield self.members[first[:, None] + np.arange(size)]

    @cached_property
    def components(self) -> IntArray:
        """For each point the number of the connected component that it belongs to, (N,).

        Points are connected when they share a neighbourhood: nothing else carries a label to them.
        """
        starts = np.cumsum(self.sizes) - self.sizes
        edges = (np.ones(len(self.members)), (self.members[starts][self.owners], self.members))
        graph = sparse.coo_array(edges, shape=(self.points, self.points)).tocsr()
        _, numbers = connected_components(graph, directed=False)
        return np.asarray(numbers, dtype=np.int64)


def given_lists(lists: Sequence[ArrayLike], points: int) -> Neighbourhoods:
    """Neighbourhoods as they are given.

    Parameters
    ----------
    lists : sequence of sequences of int
        The points of each neighbourhood, the point itself among them.
    points : int
        N.
    """
    arrays = [np.atleast_1d(np.asarray(each, dtype=np.int64)) for each in lists]
    sizes = np.array([len(each) for each in arrays], dtype=np.int64)
    members = np.concatenate(arrays) if arrays else np.empty(0, dtype=np.int64)
    return Neighbourhoods(points, members, sizes)


def temporal_windows(frames: int, width: int) -> Neighbourhoods:
    """The `width` frames around each frame; at both ends, those of them that there are (Figure 2).

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


def mesh_rings(faces: IntArray, vertices: int, rings: int = 1) -> Neighbourhoods:
    """Each vertex and those that at most `rings` edges lead to (Figure 4).

    Any triangles will do: edges of three faces, doubled and degenerate faces do no harm. A vertex
    that no face uses is alone.

    Parameters
    ----------
    faces : array of int, shape (F, 3)
    vertices : int
        V.
    rings : int
        At least 1.
    """
    if rings < 1:
        raise InputError("rings", "1 or more", f"{rings}", "One ring suits most meshes.")
    step = adjacency(faces, vertices)
    step = (step + sparse.eye_array(vertices, dtype=step.dtype)).tocsr()
    reach = step
    for _ in range(rings - 1):
        reach = (reach @ step).tocsr()
    reach.sort_indices()
    return Neighbourhoods(vertices, reach.indices.astype(np.int64), np.diff(reach.indptr))


def adjacency(faces: IntArray, vertices: int) -> sparse.csr_array:
    """1 where an edge joins two vertices, (V, V).

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


def _bad(expected: str, found: str) -> InputError:
    return InputError("neighbourhoods", expected, found, "Check the lists.")
