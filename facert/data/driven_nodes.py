"""Nodes that controls turn and shift, and the vertices that follow them.

A node's frame F takes its own axes, as it rests, to the space of the scene. Turned and shifted by X
within it, it moves what hangs on it by D = D_above F X F^-1, where D_above is what the nearest
driven node above it does. A vertex goes where its nodes take it, each by its share; what is left to
1 stays: v + sum_n share_n (D_n - 1) v. Where the skin was bound in the pose in which the character
rests, as is usual, this is linear blend skinning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class DrivenNodes:
    """N nodes, moved by P controls, and V vertices that follow them."""

    names: tuple[str, ...]
    controls: tuple[str, ...]
    """Names of those that have a driver, as in its table."""
    above: tuple[int, ...]
    """The nearest driven node above each, -1 for none; it stands before those below it."""
    frames: FloatArray
    """F of each node, (N, 4, 4)."""
    rotate: FloatArray
    """Rotation vector in radians when a control is 1, (P, N, 3)."""
    translate: FloatArray
    """Shift when a control is 1, along the node's axes and in their measure, (P, N, 3)."""
    shares: FloatArray
    """How far each vertex follows each node and what is above it, (V, N)."""

    def vectors(self, params: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotation vectors and shifts of the nodes, (T, N, 3) each, for controls (T, P)."""
        rotate, translate = (np.tensordot(params, one, 1) for one in (self.rotate, self.translate))
        return np.asarray(rotate), np.asarray(translate)

    def moved(self, vertices: FloatArray, params: FloatArray) -> FloatArray:
        """Vertices (T, V, 3) where the nodes take them for controls (T, P)."""
        motion = self._motion(params) - np.eye(4)
        found = vertices.copy()
        for node in range(len(self.names)):
            rows = np.flatnonzero(self.shares[:, node])
            matrix = motion[:, node]
            moved = (
                vertices[:, rows] @ matrix[:, :3, :3].transpose(0, 2, 1) + matrix[:, None, :3, 3]
            )
            found[:, rows] += self.shares[rows, node, None] * moved
        return found

    def transformed(self, matrix: FloatArray) -> DrivenNodes:
        """The same where all positions are multiplied by a matrix (3, 3), as of another unit."""
        frames = self.frames.copy()
        frames[:, :3] = matrix @ frames[:, :3]
        return replace(self, frames=frames)

    def _motion(self, params: FloatArray) -> FloatArray:
        """D of each node, (T, N, 4, 4)."""
        from scipy.spatial.transform import Rotation  # takes its time

        rotate, translate = self.vectors(params)
        within = np.tile(np.eye(4), (*rotate.shape[:2], 1, 1))
        turns = Rotation.from_rotvec(rotate.reshape(-1, 3)).as_matrix()
        within[:, :, :3, :3] = turns.reshape(*rotate.shape, 3)
        within[:, :, :3, 3] = translate
        motion = self.frames @ within @ np.linalg.inv(self.frames)
        for node, above in enumerate(self.above):
            if above >= 0:
                motion[:, node] = motion[:, above] @ motion[:, node]
        return np.asarray(motion)
