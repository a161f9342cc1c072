"""Feature points that serve driving best: where a rig's shapes are hardest to guess.

First some points on the rim, far from each other, since without them no method knows where the face
ends. Then, one after the other, the vertex that the framework misses most over all shapes of the
rig, guessing from the points so far. Lips, lids and brows come by themselves: they move most, and
unlike what is around them.

A new point changes the guess by a multiple of one column of the Green's function, so that a partial
Cholesky factorisation of it with these pivots is all that is needed: one sparse solution a point.
"""

from __future__ import annotations

import numpy as np

from facert.data import FloatArray, IntArray, Rig
from facert.errors import InputError
from facert.topology.driving import smooth_energy
from facert.topology.labels import checked_labels
from facert.topology.neighbourhoods import mesh_rings
from facert.topology.solution import Elimination

RIM = 0.1  # share of the points that are on the rim
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
    return np.concatenate([rim, _hardest(rig, rim, count - len(rim))])


def spread_vertices(rig: Rig, count: int) -> IntArray:
    """One vertex of each connected part, then rim vertices far from each other, (n,)."""
    components = mesh_rings(rig.faces, len(rig.neutral)).components
    chosen = list(np.unique(components, return_index=True)[1])
    rim = rim_vertices(rig.faces)
    candidates = rim if len(rim) else np.arange(len(rig.neutral))
    places = rig.neutral[candidates]
    distance = np.full(len(candidates), np.inf)
    for vertex in chosen:
        distance = np.minimum(distance, np.linalg.norm(places - rig.neutral[vertex], axis=1))
    while len(chosen) < count and distance.max() > 0:
        farthest = int(distance.argmax())
        chosen.append(candidates[farthest])
        distance = np.minimum(distance, np.linalg.norm(places - places[farthest], axis=1))
    return np.array(chosen, dtype=np.int64)


def rim_vertices(faces: IntArray) -> IntArray:
    """Vertices of edges that only one triangle has."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    different, counts = np.unique(edges, axis=0, return_counts=True)
    return np.unique(different[counts == 1])


def _hardest(rig: Rig, given: IntArray, count: int) -> IntArray:
    """The vertices that are missed most, each guessed from the given ones and those before."""
    solution = Elimination(
        smooth_energy(rig.neutral, rig.faces), checked_labels(given, len(rig.neutral))
    )
    shapes = _evened(rig.shapes)  # (V, 3 P)
    missed = shapes - solution(shapes[given])
    factor = np.zeros((len(missed), count))
    chosen = np.zeros(count, dtype=np.int64)
    taken = np.isin(np.arange(len(missed)), given)
    for step in range(count):
        pivot = np.where(taken, -1.0, np.sum(missed**2, axis=1)).argmax()
        chosen[step], taken[pivot] = pivot, True
        column = solution.green(int(pivot)) - factor @ factor[pivot]
        missed -= np.outer(column / column[pivot], missed[pivot])
        factor[:, step] = column / np.sqrt(column[pivot])
    return chosen


def _evened(shapes: FloatArray) -> FloatArray:
    """Shapes as columns (V, 3 P), large ones made smaller."""
    size = np.sqrt(np.mean(np.sum(shapes**2, axis=2), axis=1))
    moving = size > 0
    if not moving.any():
        raise InputError("/shapes", "shapes that move something", "none", "Check the rig.")
    even = shapes[moving] / size[moving, None, None] ** EVEN
    return np.ascontiguousarray(even.transpose(1, 0, 2).reshape(shapes.shape[1], -1))
