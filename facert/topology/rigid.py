"""Carrying along what no label holds: eyes, teeth and lashes follow the face rigidly.

A part without labels moves as the face near it does: with the rotation and the translation that
fit best what its anchors do (Kabsch 1976), the vertices of the labelled face that are nearest to
it. A pull towards no rotation decides where the anchors are too few, or lie on a line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from facert.data import BoolArray, FloatArray, IntArray

REST = 1e-6  # of the anchors' spread: how hard the pull towards no rotation is


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
        rest = neutral[self.anchors]
        rotations, moved = best_rotations(rest, deformed[:, self.anchors])
        arms = neutral[self.part] - rest.mean(axis=0)
        deformed[:, self.part] = arms @ rotations.transpose(0, 2, 1) + moved[:, None, :]


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


def best_rotations(rest: FloatArray, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation and place of the centre that take points nearest to others, for many frames.

    Parameters
    ----------
    rest : array, shape (m, 3)
    moved : array, shape (T, m, 3)

    Returns
    -------
    rotations : array, shape (T, 3, 3)
    centres : array, shape (T, 3)
        Of the moved points.
    """
    arms, centres = rest - rest.mean(axis=0), moved.mean(axis=1)
    covariance = (moved - centres[:, None, :]).transpose(0, 2, 1) @ arms
    pull = REST * float(np.sum(arms**2)) or 1.0
    U, _, Vt = np.linalg.svd(covariance + pull * np.eye(3))
    turn = np.ones((len(moved), 3))
    turn[:, 2] = np.sign(np.linalg.det(U @ Vt))  # a rotation, never a mirror
    return np.asarray((U * turn[:, None, :]) @ Vt), np.asarray(centres)
