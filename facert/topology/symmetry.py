"""Which vertex lies opposite to which, on a face whose two halves are alike."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from facert.data.arrays import FloatArray, IntArray

NEAR = 0.2  # of the median distance of neighbouring vertices: no farther from its mirror image
MOST = 0.95  # of the vertices must find theirs


def mirror_vertices(neutral: FloatArray) -> IntArray:
    """The vertex opposite to each, (V,): itself on the middle line, or where there is none.

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
