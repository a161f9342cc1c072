"""Face driving (section 3.3): a few feature points move, the whole face follows.

The vertices of the neutral face are the source points X, the new positions of the feature points
the labels. The rings of the mesh are the neighbourhoods and d = 2, a surface's dimension.

What is solved for are *displacements*: the target is X + Z with trace(Zᵀ B Z) least, which is
(9) with the right-hand side B X. As it is written, (9) asks the *positions* to be flat in each
tangent plane; a curved face then moves though no label does (`literal`, kept for comparison).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.errors import InputError
from facert.mesh.rigid import align
from facert.topology import laplacian
from facert.topology.alignment_matrix import alignment_matrix
from facert.topology.labels import checked_labels, lacking_components, require_enough_labels
from facert.topology.neighbourhoods import Neighbourhoods, mesh_rings
from facert.topology.radial_basis import RadialFunction, radial_basis
from facert.topology.solution import Dense, Elimination, Interpolant

SURFACE = 2  # d
SMOOTHNESS = 0.3  # λ of the uniform Laplacian
PULL = 1e-6  # towards no rotation: where the anchors of a carried part are few, or on a line
DENSE = 2**25  # most entries of an influence matrix, 256 MiB
Energy = Callable[[FloatArray, IntArray], sparse.csc_array]
LooseParts = Literal["refuse", "carry"]


@dataclass(frozen=True)
class DrivingMethod:
    """Rule by which labels are interpolated to the other vertices."""

    # From vertices (V, 3) and faces (F, 3) to a quadratic energy (V, V)
    energy: Energy | None = None
    radial: RadialFunction = "linear"  # The radial basis function, where there is no energy
    displacements: bool = True  # Whether displacements are interpolated, or positions

    def interpolant(self, vertices: FloatArray, faces: IntArray, labelled: IntArray) -> Interpolant:
        """The map from the labelled vertices (M,) to all of them."""
        if self.energy is None:
            return radial_basis(vertices, labelled, self.radial)
        return Elimination(self.energy(vertices, faces), labelled)


def framework_energy(vertices: FloatArray, faces: IntArray) -> sparse.csc_array:
    """B of Algorithm 1 for a surface, (V, V)."""
    return alignment_matrix(vertices, mesh_rings(faces, len(vertices)), SURFACE)


def smooth_energy(vertices: FloatArray, faces: IntArray) -> sparse.csc_array:
    """B + λ Lᵀ L with the uniform Laplacian, (V, V).

    To (9) an affine map of a tangent plane is free, and a thin strip of triangles may turn as it
    likes. The second term holds it to its surroundings.
    """
    smoothness = laplacian.uniform_energy(vertices, faces)
    return sparse.csc_array(framework_energy(vertices, faces) + SMOOTHNESS * smoothness)


METHODS = {
    "smooth": DrivingMethod(smooth_energy),
    "framework": DrivingMethod(framework_energy),
    "literal": DrivingMethod(framework_energy, displacements=False),  # (9) as it is written
    "laplacian": DrivingMethod(laplacian.uniform_energy),
    "cotangent": DrivingMethod(laplacian.cotangent_energy),
    "biharmonic": DrivingMethod(laplacian.biharmonic_energy),
    "rbf-linear": DrivingMethod(radial="linear"),
    "rbf-thin-plate": DrivingMethod(radial="thin_plate_spline"),
}
"""Every way to drive a face, the shipped default first."""

DEFAULT = "smooth"


class FaceDriver:
    """A neutral face that follows its feature points, frame by frame or in batches.

    Eyes, teeth and lashes that no feature point moves may follow the face rigidly: each part with
    the rotation and the translation that fit best what its anchors do (Kabsch 1976), the vertices
    of the labelled face that are nearest to it.

    Parameters
    ----------
    neutral : array, shape (V, 3)
        Rest positions.
    faces : array of int, shape (F, 3)
        Triangles.
    labelled : array of int, shape (M,)
        The vertex of each feature point.
    method : str
        One of `METHODS`.
    loose : {"refuse", "carry"}
        What to do with connected parts without a feature point: raise, or carry them rigidly with
        the nearest part that has one.

    Raises
    ------
    InputError
        For an unknown method, points that are no vertices, doubled ones, or too few; for parts
        without a point, unless they are carried.
    """

    def __init__(
        self,
        neutral: FloatArray,
        faces: IntArray,
        labelled: IntArray,
        method: str = DEFAULT,
        loose: LooseParts = "refuse",
    ) -> None:
        if neutral.ndim != 2 or neutral.shape[1] != 3 or not np.isfinite(neutral).all():
            found = f"{neutral.shape}, or NaN"
            raise InputError("/neutral", "finite positions (V, 3)", found, "Check the export.")
        self.neutral = neutral
        self.labelled = checked_labels(labelled, len(neutral))
        if method not in METHODS:
            known = ", ".join(METHODS)
            raise InputError("method", f"one of {known}", repr(method), "Choose another.")
        self._method = METHODS[method]
        self._rest = neutral if self._method.displacements else np.zeros_like(neutral)
        self._carried: list[tuple[IntArray, IntArray]] = []  # each part with its anchors
        held = np.full(len(neutral), True)
        if self._method.energy is not None:  # it reaches no farther than the mesh does
            held = self._held_by_labels(mesh_rings(faces, len(neutral)), loose)
        self._held = np.flatnonzero(held)
        self._interpolant = self._solve(faces)

    def _held_by_labels(self, rings: Neighbourhoods, loose: LooseParts) -> BoolArray:
        """Mask of vertices in parts with labels, (V,); the others are carried, if allowed."""
        if loose == "refuse":
            require_enough_labels(rings, self.labelled)
        lacking = lacking_components(rings, self.labelled)
        held = ~np.isin(rings.components, lacking)
        if len(lacking):
            self._carried = _parts_with_anchors(self.neutral, rings.components, held)
        return held

    def _solve(self, faces: IntArray) -> Interpolant:
        """The interpolant over the held vertices, dense where that is not too large."""
        number = np.full(len(self.neutral), -1)
        number[self._held] = np.arange(len(self._held))
        faces = number[faces]
        solution = self._method.interpolant(
            self.neutral[self._held], faces[(faces >= 0).all(axis=1)], number[self.labelled]
        )
        few = len(self._held) * len(self.labelled) <= DENSE
        return Dense(solution.influence) if few else solution

    def deform(self, points: FloatArray) -> FloatArray:
        """The whole face for positions of the feature points.

        Parameters
        ----------
        points : array, shape (T, M, 3)
            In the order of `labelled`, in the mesh's units.

        Returns
        -------
        array, shape (T, V, 3)

        Raises
        ------
        InputError
            For another shape, or positions that are not finite.
        """
        expected = (len(self.labelled), 3)
        if points.ndim != 3 or points.shape[1:] != expected or not np.isfinite(points).all():
            raise InputError(
                "points",
                f"finite positions (T, {expected[0]}, 3)",
                f"{points.shape}" if np.isfinite(points).all() else "NaN or infinity",
                "Give every feature point in every frame.",
            )
        given = points - self._rest[self.labelled]
        # One product for all frames: (V, M) times (M, 3 T).
        moved = self._interpolant(given.transpose(1, 0, 2)).transpose(1, 0, 2)
        if not self._carried:
            return np.add(moved, self._rest, order="C")
        deformed = np.empty((len(points), *self.neutral.shape))
        deformed[:, self._held] = moved + self._rest[self._held]
        for part, anchors in self._carried:
            followed = deformed[:, anchors]
            motion = align(self.neutral[anchors], followed, np.ones(followed.shape[:2]), PULL)
            deformed[:, part] = motion.apply(self.neutral[part])
        return deformed


def _parts_with_anchors(
    vertices: FloatArray, components: IntArray, held: BoolArray
) -> list[tuple[IntArray, IntArray]]:
    """The connected components that are not held by labels (V,), each with its anchors."""
    candidates = np.flatnonzero(held)
    tree = cKDTree(vertices[candidates])
    found = []
    for component in np.unique(components[~held]):
        part = np.flatnonzero(components == component)
        distance, nearest = map(np.asarray, tree.query(vertices[part]))
        # The nearest labelled component: a part between two does not follow both.
        home = components[candidates[nearest[distance.argmin()]]]
        near = candidates[nearest]
        found.append((part, np.unique(near[components[near] == home])))
    return found
