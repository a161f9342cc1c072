"""The characters of the experiments: faces of two rigs, with the same feature points on each.

The actor and half of the targets are identities of ICT-FaceKit. The others are MakeHuman's head,
another mesh with shapes by other hands, in its ARKit shapes or its own expression units. Feature
points are 51 landmarks of brows, eyes, nose and lips, and 29 vertices of the rim and the cheeks
that lie farthest from all others. On MakeHuman's head, each is the vertex that lies where the
point lies and moves as it moves, once an affine map, fitted to the places that each shape moves,
has laid one face on the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from experiments.tracks import DATA
from facert.data.arrays import FloatArray, IntArray
from facert.data.names import NameIndex, shape_drivers
from facert.data.rig import Mesh, Rig
from facert.io.formats import read_rig_file

POINTS = 80
LANDMARKS = slice(17, 68)  # of the usual 68; the first 17 run along the jaw
DECIMETRES = 10.0  # MakeHuman's unit, in ICT-FaceKit's centimetres
IDENTITIES = 8


@dataclass(frozen=True, eq=False)
class Character:
    """A face, its shapes and its feature points.

    Attributes
    ----------
    mesh : Mesh
        V vertices, in centimetres.
    shapes : array, shape (K, V, 3)
    names : tuple of str, length K
    points : array of int, shape (80,)
        Vertices, the same places on every character.
    """

    mesh: Mesh
    shapes: FloatArray
    names: tuple[str, ...]
    points: IntArray

    @property
    def rig(self) -> Rig:
        """The same as a rig."""
        return Rig(self.mesh.vertices, self.shapes, self.names, self.mesh.faces, "cm")

    def settings(self, weights: FloatArray, names: tuple[str, ...]) -> FloatArray:
        """Its own parameters (T, K) for weights (T, P) of any spelling."""
        return weights @ shape_drivers(names, self.names)

    def pose(self, settings: FloatArray) -> FloatArray:
        """All vertices (T, V, 3) for parameters (T, K)."""
        flat = self.shapes.reshape(len(self.shapes), -1)
        return self.mesh.vertices + (settings @ flat).reshape(-1, *self.mesh.vertices.shape)

    def move(self, settings: FloatArray, vertices: IntArray) -> FloatArray:
        """Some vertices (T, n, 3) for parameters (T, K)."""
        flat = self.shapes[:, vertices].reshape(len(self.shapes), -1)
        return self.mesh.vertices[vertices] + (settings @ flat).reshape(-1, len(vertices), 3)


@cache
def _ict_arrays() -> tuple[FloatArray, IntArray, IntArray]:
    """Identity modes (8, V, 3), the vertices of the narrow face, the 68 landmarks."""
    with np.load(DATA / "rigs" / "ict_face.npz") as arrays:
        modes = arrays["identity"].astype(np.float64)
        return modes, arrays["narrow_face"].astype(int), arrays["landmarks68"].astype(int)


@cache
def _ict_face() -> Character:
    """The narrow face of ICT-FaceKit's mean identity."""
    rig = read_rig_file(DATA / "rigs" / "ict_face.npz")
    _, kept, landmarks = _ict_arrays()
    mesh, shapes = _cut(rig.mesh, rig.shapes, kept)
    inner = np.searchsorted(np.sort(kept), landmarks[LANDMARKS])
    return Character(mesh, shapes, rig.names, farthest_points(mesh.vertices, POINTS, inner))


def ict(identity: FloatArray) -> Character:
    """The narrow face of an identity, (8,) coefficients."""
    face, (modes, kept, _) = _ict_face(), _ict_arrays()
    vertices = face.mesh.vertices + np.tensordot(identity, modes[:, np.sort(kept)], 1)
    return Character(Mesh(vertices, face.mesh.faces, "cm"), face.shapes, face.names, face.points)


def ict_landmarks() -> FloatArray:
    """The usual 68 landmarks of the mean identity, (68, 3)."""
    rig = read_rig_file(DATA / "rigs" / "ict_face.npz")
    return rig.neutral[_ict_arrays()[2]]


@cache
def makehuman(shapes: str) -> Character:
    """MakeHuman's head, with its ``"arkit"`` or its ``"unit"`` shapes."""
    rig = read_rig_file(DATA / "rigs" / "makehuman_head.npz", shapes)
    mesh = Mesh(rig.neutral * DECIMETRES, rig.faces, "cm")
    points = on_makehuman(_ict_face().points)
    return Character(mesh, rig.shapes * DECIMETRES, rig.names, points)


def on_makehuman(vertices: IntArray) -> IntArray:
    """The vertices of MakeHuman's head that are these of ICT-FaceKit's face."""
    ict_features, makehuman_features = _features()
    return _matched(ict_features[vertices], makehuman_features)


def on_ict(vertices: IntArray) -> IntArray:
    """The vertices of ICT-FaceKit's face that are these of MakeHuman's head."""
    ict_features, makehuman_features = _features()
    return _matched(makehuman_features[vertices], ict_features)


@cache
def _features() -> tuple[FloatArray, FloatArray]:
    """Where every vertex lies and how each shape that both rigs have moves it, (V, D) twice.

    Of ICT-FaceKit's face, and of MakeHuman's head laid on it by the affine map between the places
    that the shapes move.
    """
    rig, face = read_rig_file(DATA / "rigs" / "makehuman_head.npz", "arkit"), _ict_face()
    own, others = _shared(rig.names, face.names)
    there = _centres(face.mesh.vertices, face.shapes[others])
    laid = affine_map(_centres(rig.neutral, rig.shapes[own]), there)
    neutral = laid(rig.neutral)
    moved = laid(rig.neutral + rig.shapes[own]) - neutral
    return _place_and_motion(face.mesh.vertices, face.shapes[others]), _place_and_motion(
        neutral, moved
    )


def _place_and_motion(vertices: FloatArray, shapes: FloatArray) -> FloatArray:
    motion = shapes.transpose(1, 0, 2).reshape(len(vertices), -1)
    return np.column_stack([vertices, 2.0 * motion])


def _matched(wanted: FloatArray, among: FloatArray) -> IntArray:
    """Different rows of `among`, each nearest to a wanted one, at the least cost in all."""
    return np.asarray(linear_sum_assignment(cdist(wanted, among))[1])


def _cut(mesh: Mesh, shapes: FloatArray, kept: IntArray) -> tuple[Mesh, FloatArray]:
    """The part of a mesh that has these vertices, in rising order."""
    kept = np.sort(kept)
    number = np.full(len(mesh.vertices), -1)
    number[kept] = np.arange(len(kept))
    faces = number[mesh.faces]
    faces = faces[(faces >= 0).all(axis=1)]
    return Mesh(mesh.vertices[kept], faces, "cm"), shapes[:, kept]


def farthest_points(vertices: FloatArray, count: int, given: IntArray | None = None) -> IntArray:
    """Vertices that lie far from each other: after the given ones, each the farthest from all."""
    points = [0] if given is None else list(given)
    distance = cKDTree(vertices[points]).query(vertices)[0]
    while len(points) < count:
        points.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(vertices - vertices[points[-1]], axis=1))
    return np.array(points)


def _shared(names: tuple[str, ...], others: tuple[str, ...]) -> tuple[list[int], list[int]]:
    """The indices of the names that both lists have, in any spelling."""
    index = NameIndex.among(others, names, "the names of the others", quiet=True)
    found = [(one, index.find(name)) for one, name in enumerate(names)]
    both = [(one, other) for one, other in found if other is not None]
    return [one for one, _ in both], [other for _, other in both]


def _centres(neutral: FloatArray, shapes: FloatArray) -> FloatArray:
    """The mean place (K, 3) of what each shape moves, weighted by the square of its motion."""
    weight = (shapes**2).sum(axis=2)
    return weight @ neutral / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)


def affine_map(here: FloatArray, there: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """The affine map from places (n, 3) to places (n, 3), by least squares."""
    middle = here.mean(axis=0)
    linear = np.linalg.lstsq(here - middle, there - there.mean(axis=0), rcond=None)[0]
    return lambda places: (places - middle) @ linear + there.mean(axis=0)
