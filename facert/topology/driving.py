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
from facert.topology.radial_basis import Kernel, radial_basis
from facert.topology.solution import Dense, Elimination, Interpolant

SURFACE = 2  # d
SMOOTHNESS = 0.3  # λ of the uniform Laplacian
PULL = 1e-6  # of what is carried, towards no rotation
DENSE = 2**25  # most entries of an influence matrix, 256 MiB
Energy = Callable[[FloatArray, IntArray], sparse.csc_array]
LooseParts = Literal["refuse", "carry"]


@dataclass(frozen=True)
class DrivingMethod:
    """How labels reach the other vertices.

    Parameters
    ----------
    summary : str
        One line for a person who chooses.
    energy : callable, optional
        From vertices (V, 3) and faces (F, 3) to a quadratic energy (V, V).
    kernel : str, optional
        The radial basis function, where there is no energy.
    quantity : {"displacements", "positions"}
        What is interpolated.
    """

    summary: str
    energy: Energy | None = None
    kernel: Kernel | None = None
    quantity: Literal["displacements", "positions"] = "displacements"

    def interpolant(self, vertices: FloatArray, faces: IntArray, labelled: IntArray) -> Interpolant:
        """From the labelled vertices (M,) to all of them."""
        if self.energy is None:
            assert self.kernel is not None
            return radial_basis(vertices, labelled, self.kernel)
        return Elimination(self.energy(vertices, faces), labelled)


def framework_energy(vertices: FloatArray, faces: IntArray) -> sparse.csc_array:
    """B of Algorithm 1 for a surface, (V, V)."""
    return alignment_matrix(vertices, mesh_rings(faces, len(vertices)), SURFACE)


def smooth_energy(vertices: FloatArray, faces: IntArray) -> sparse.csc_array:
    """B + λ Lᵀ L with the uniform Laplacian, (V, V).

    To (9) an affine map of a tangent plane is free, and a thin strip of triangles may turn as it
    likes. The second term holds it to its surroundings.
    """
    smoothness = laplacian.uniform_energy(faces, len(vertices))
    return sparse.csc_array(framework_energy(vertices, faces) + SMOOTHNESS * smoothness)


METHODS = {
    "smooth": DrivingMethod("the framework with a uniform Laplacian", smooth_energy),
    "framework": DrivingMethod("the paper's framework, on displacements", framework_energy),
    "literal": DrivingMethod(
        "equation (9) as it is written, on positions", framework_energy, quantity="positions"
    ),
    "laplacian": DrivingMethod(
        "Laplacian editing, uniform weights", lambda v, f: laplacian.uniform_energy(f, len(v))
    ),
    "cotangent": DrivingMethod("Laplacian editing, cotangent weights", laplacian.cotangent_energy),
    "biharmonic": DrivingMethod("bending of a thin sheet", laplacian.biharmonic_energy),
    "rbf-linear": DrivingMethod("radial basis functions |r|", kernel="linear"),
    "rbf-thin-plate": DrivingMethod("radial basis functions r² log r", kernel="thin_plate_spline"),
}
"""Every way to drive a face, the shipped default first."""

DEFAULT = "smooth"


class FaceDriver:
    """A neutral face that follows its feature points, frame by frame or in batches.

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
        self.neutral = _checked_neutral(neutral)
        self.labelled = checked_labels(labelled, len(neutral))
        self._method = chosen_method(method)
        displaced = self._method.quantity == "displacements"
        self._rest = self.neutral if displaced else np.zeros_like(neutral)
        self._followers: list[Follower] = []
        held = np.full(len(neutral), True)
        if self._method.energy is not None:  # it reaches no farther than the mesh does
            held = self._held_by_labels(mesh_rings(faces, len(neutral)), loose)
        self._held = np.flatnonzero(held)
        self._interpolant = self._solve(faces)

    def _held_by_labels(self, rings: Neighbourhoods, loose: LooseParts) -> BoolArray:
        """Which vertices are in parts with labels, (V,); the others follow, if they may."""
        if loose == "refuse":
            require_enough_labels(rings, self.labelled)
        lacking = lacking_components(rings, self.labelled)
        held = ~np.isin(rings.components, lacking)
        self._followers = followers(self.neutral, rings.components, held)
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
        if not self._followers:
            return np.add(moved, self._rest, order="C")
        deformed = np.empty((len(points), *self.neutral.shape))
        deformed[:, self._held] = moved + self._rest[self._held]
        for follower in self._followers:
            follower.carry(self.neutral, deformed)
        return deformed


def chosen_method(name: str) -> DrivingMethod:
    """The method of that name.

    Raises
    ------
    InputError
        When there is none.
    """
    if name not in METHODS:
        raise InputError("method", f"one of {', '.join(METHODS)}", repr(name), "Choose another.")
    return METHODS[name]


def _checked_neutral(neutral: FloatArray) -> FloatArray:
    if neutral.ndim != 2 or neutral.shape[1] != 3 or not np.isfinite(neutral).all():
        raise InputError(
            "/neutral", "finite positions (V, 3)", f"{neutral.shape}, or NaN", "Check the export."
        )
    return neutral


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
