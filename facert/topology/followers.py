"""Carrying along what no label holds: eyes, teeth and lashes follow the face rigidly.

A part without labels moves as the face near it does: with the rotation and the translation that
fit best what its anchors do (Kabsch 1976), the vertices of the labelled face that are nearest to
it. A pull towards no rotation decides where the anchors are too few, or lie on a line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.mesh.rigid import align

PULL = 1e-6  # towards no rotation


@dataclass(frozen=True, eq=False)
class Follower:
    """A part that follows its anchors.

    Parameters
    ----------
    part : array of int, shape (n,)
        Vertices that are carried.
    anchors : array of int, shape (m,)
        Vertices that they follow.
    """

    part: IntArray
    anchors: IntArray

    def carry(self, neutral: FloatArray, deformed: FloatArray) -> None:
        """Move the part in every frame of `deformed` (T, V, 3), in place.

        Parameters
        ----------
        neutral : array, shape (V, 3)
        deformed : array, shape (T, V, 3)
            With the anchors where they should be.
        """
        anchors = deformed[:, self.anchors]
        motion = align(neutral[self.anchors], anchors, np.ones(anchors.shape[:2]), PULL)
        deformed[:, self.part] = motion.apply(neutral[self.part])


def followers(vertices: FloatArray, components: IntArray, held: BoolArray) -> list[Follower]:
    """One for each connected component that is not held by labels.

    Parameters
    ----------
    vertices : array, shape (V, 3)
    components : array of int, shape (V,)
        The number of the component of each vertex.
    held : array of bool, shape (V,)
        Which vertices belong to a component with labels.
    """
    if held.all():
        return []
    candidates = np.flatnonzero(held)
    tree = cKDTree(vertices[candidates])
    found = []
    for component in np.unique(components[~held]):
        part = np.flatnonzero(components == component)
        distance, nearest = map(np.asarray, tree.query(vertices[part]))
        # The nearest labelled component: a part between two does not follow both.
        home = components[candidates[nearest[distance.argmin()]]]
        near = candidates[nearest]
        found.append(Follower(part, np.unique(near[components[near] == home])))
    return found
