"""Feature points that serve driving best: where a rig's shapes are hardest to predict.

First some points on the rim, far from each other, since without them no method sees where the face
ends. Then, one after the other, the vertex that the framework misses most over all shapes of the
rig, predicted from the points so far. Lips, lids and brows come by themselves: they move most, and
unlike what is around them.

On a face whose halves are alike, a vertex comes with the one opposite to it, so that both sides
are driven alike.

A new point changes the prediction by a multiple of one column of the Green's function, so that a
partial Cholesky factorisation of it with these pivots is all that is needed: one sparse solution a
point.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import Rig
from facert.errors import InputError
from facert.topology.driving import smooth_energy
from facert.topology.labels import checked_labels
from facert.topology.neighbourhoods import mesh_rings
from facert.topology.solution import Elimination

RIM = 0.1  # share of the points that are on the rim
NEAR = 0.2  # of the median distance of neighbouring vertices: no farther from its mirror image
MOST = 0.95  # of the vertices must find theirs
EVEN = 0.25  # power that evens out large and small shapes: 0 takes them as they are, 1 as equals


def suggest_points(rig: Rig, count: int) -> IntArray:
    """Vertices to serve as feature points, (count,), in the order in which they help.

    Parameters
    ----------
    rig : Rig
    count : int
        At least one a connected part of the mesh, and no more than its vertices.

    Raises
    ------
    InputError
        For another count, or a rig whose shapes move nothing.
    """
    rim = spread_vertices(rig, max(1, round(RIM * count)))
    if not len(rim) <= count <= len(rig.neutral):
        raise InputError(
            "-n", f"{len(rim)} to {len(rig.neutral)}", f"{count}", "Choose another number."
        )
    return _hardest(rig, rim, count)


def spread_vertices(rig: Rig, count: int) -> IntArray:
    """A vertex of each connected part, then rim vertices far from each other, (n,).

    Each with its opposite. They are `count`, or more if there are more parts.
    """
    rim, mirror = rim_vertices(rig.faces), mirror_vertices(rig.neutral)
    candidates = rim if len(rim) else np.arange(len(rig.neutral))
    components = mesh_rings(rig.faces, len(rig.neutral)).components
    chosen: list[int] = []
    middle_first = np.argsort(mirror != np.arange(len(mirror)), kind="stable")
    for first in middle_first[np.unique(components[middle_first], return_index=True)[1]]:
        if components[first] not in components[chosen]:
            chosen += _with_opposite(int(first), mirror)
    while len(chosen) < count:
        fitting = _fitting(candidates, mirror, count - len(chosen))
        distance = cdist(rig.neutral[fitting], rig.neutral[chosen]).min(axis=1)
        if distance.max(initial=0.0) <= 0:
            break
        chosen += _with_opposite(int(fitting[distance.argmax()]), mirror)
    return np.array(chosen, dtype=np.int64)


def _with_opposite(vertex: int, mirror: IntArray) -> list[int]:
    """A vertex and the one opposite to it; only one on the middle line."""
    return list(dict.fromkeys([vertex, int(mirror[vertex])]))


def _fitting(vertices: IntArray, mirror: IntArray, room: int) -> IntArray:
    """The vertices that fit with their opposites where `room` more may be chosen, if any do."""
    middle = vertices[mirror[vertices] == vertices]
    return middle if room == 1 and len(middle) else vertices


def rim_vertices(faces: IntArray) -> IntArray:
    """Vertices of edges that only one triangle has."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    different, counts = np.unique(edges, axis=0, return_counts=True)
    return np.unique(different[counts == 1])


def _hardest(rig: Rig, given: IntArray, count: int) -> IntArray:
    """The given vertices, then each time that of largest error given those before, (count,)."""
    predicted = _PredictedShapes(rig, given)
    mirror, everywhere = mirror_vertices(rig.neutral), np.arange(len(rig.neutral))
    chosen = list(given)
    while len(chosen) < count:
        room = count - len(chosen)
        fitting = _fitting(np.setdiff1d(everywhere, chosen), mirror, room)
        hardest = int(fitting[predicted.squared_errors[fitting].argmax()])
        for vertex in _with_opposite(hardest, mirror)[:room]:
            if vertex not in chosen:
                predicted.add(vertex)
                chosen.append(vertex)
    return np.array(chosen, dtype=np.int64)


class _PredictedShapes:
    """The shapes of a rig as the framework predicts them from some vertices."""

    def __init__(self, rig: Rig, given: IntArray) -> None:
        energy = smooth_energy(rig.neutral, rig.faces)
        self._solution = Elimination(energy, checked_labels(given, len(rig.neutral)))
        shapes = _evened(rig.shapes)
        self._errors = shapes - self._solution(shapes[given])  # (V, 3 P)
        self._factor = np.zeros((len(shapes), 0))

    @property
    def squared_errors(self) -> FloatArray:
        """Squared error of each vertex, (V,)."""
        return np.asarray(np.einsum("vp,vp->v", self._errors, self._errors))

    def add(self, vertex: int) -> None:
        """Predict from this vertex too: a step of the Cholesky factorisation."""
        column = self._solution.green(vertex) - self._factor @ self._factor[vertex]
        self._errors -= np.outer(column / column[vertex], self._errors[vertex])
        self._factor = np.column_stack([self._factor, column / np.sqrt(column[vertex])])


def _evened(shapes: FloatArray) -> FloatArray:
    """Shapes as columns (V, 3 P), their sizes evened: large ones made smaller."""
    size = np.sqrt(np.mean(np.sum(shapes**2, axis=2), axis=1))
    moving = size > 0
    if not moving.any():
        raise InputError("/shapes", "shapes that move something", "none", "Check the rig.")
    even = shapes[moving] / size[moving, None, None] ** EVEN
    return np.ascontiguousarray(even.transpose(1, 0, 2).reshape(shapes.shape[1], -1))


def mirror_vertices(neutral: FloatArray) -> IntArray:
    """Index of each vertex's mirror image, (V,): itself on the middle line, or without one.

    The plane is square to an axis, halfway along it. Where less than 95 % of the vertices find
    their opposite, a face is not symmetric, and every vertex is its own.

    Parameters
    ----------
    neutral : array, shape (V, 3)
    """
    alone = np.arange(len(neutral))
    if len(neutral) < 2:
        return alone
    found = [_across(neutral, axis) for axis in range(3)]
    shares = [np.mean(opposite >= 0) for opposite in found]
    best = int(np.argmax(shares))
    if shares[best] < MOST:
        return alone
    return np.where(found[best] >= 0, found[best], alone)


def _across(neutral: FloatArray, axis: int) -> IntArray:
    """The opposite of each vertex across the plane square to an axis, or -1, (V,)."""
    reflected = neutral.copy()
    extent = neutral[:, axis].min() + neutral[:, axis].max()
    reflected[:, axis] = extent - neutral[:, axis]
    tree = cKDTree(neutral)
    spacing = np.median(np.asarray(tree.query(neutral, 2)[0])[:, 1])
    distance, opposite = map(np.asarray, tree.query(reflected))
    mutual = opposite[opposite] == np.arange(len(neutral))
    return np.where(mutual & (distance <= NEAR * spacing), opposite, -1)
