"""The feature points of a take, ready to drive a face: each with its vertex, in every frame."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import match
from facert.data.rig import Mesh
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.models.gaussian import TOGETHER, fill_gaps
from facert.preprocess.motion.motion_factors import fill_by_factors
from facert.topology.labels import checked_labels

Where = Mapping[str, object] | Literal["names", "nearest"]
Fit = Literal["none", "uniform", "axes"]

FAR = 0.1  # of the face's radius: farther from its vertices, a point is one of another face
_VERTEX_NAME = re.compile(r"v?(\d{1,9})", re.IGNORECASE)

log = logging.getLogger("facert")


@dataclass(frozen=True, eq=False)
class FeaturePoints:
    """Points that a face follows."""

    vertices: IntArray  # (M,): The vertex of each
    positions: FloatArray  # (T, M, 3): In the space and units of the mesh, without gaps


def feature_points(
    take: Take, mesh: Mesh, where: Where = "names", rest: int = 0, fit: Fit = "none"
) -> FeaturePoints:
    """The markers of a take as feature points of a mesh.

    Parameters
    ----------
    take : Take
        Markers; those that are seen in no frame are left out.
    mesh : Mesh
        At rest.
    where : mapping, "names" or "nearest"
        The vertex of each marker: from a map of marker names, after which those that it leaves
        out are not used; from the markers' names, as in ``v1204``; or the vertex nearest to it in
        the frame at rest.
    rest : int
        The frame in which the face that the markers come from rests.
    fit : {"none", "uniform", "axes"}
        How markers of another face are carried over, see `carried_over`.

    Raises
    ------
    InputError
        For weights instead of markers, a frame that there is not, or markers that do not find
        their vertex.
    """
    if take.source.kind != "markers":
        raise InputError("/source", "markers", "weights", "Give positions of feature points.")
    if not 0 <= rest < len(take):
        raise InputError("--rest", f"a frame from 0 to {len(take) - 1}", f"{rest}", "Choose one.")
    seen = np.flatnonzero(take.source.valid.any(axis=0))
    names = [take.source.names[point] for point in seen]
    markers = Source(take.source.values[:, seen], tuple(names))
    positions = without_gaps(markers).reshape(markers.values.shape)
    if where == "names":
        vertices = named_vertices(names)
    elif where == "nearest":
        vertices = nearest_vertices(positions[rest], mesh.vertices)
    else:
        chosen, vertices = mapped_vertices(where, names)
        positions = positions[:, chosen]
    vertices = checked_labels(vertices, len(mesh.vertices))
    home = mesh.vertices[vertices]
    if fit == "none":
        _require_near(np.linalg.norm(positions[rest] - home, axis=1), mesh.vertices)
        return FeaturePoints(vertices, positions)
    return FeaturePoints(vertices, carried_over(positions, positions[rest], home, fit))


def without_gaps(source: Source) -> FloatArray:
    """A source as a matrix in which hidden values are imputed from those that are seen, (T, D).

    Every marker or weight must be observed in some frame.
    """
    hidden = np.count_nonzero(~source.valid)
    if hidden:
        log.info("%d of %d positions were hidden: filled", hidden, source.valid.size)
    many = source.matrix.shape[1] > TOGETHER
    return fill_by_factors(source.matrix) if many else fill_gaps(source.matrix)


def named_vertices(names: Sequence[str]) -> IntArray:
    """The vertices that points are named after, as in ``v1204`` or ``1204``, (M,).

    Raises
    ------
    InputError
        When a name is another.
    """
    found = [_VERTEX_NAME.fullmatch(name) for name in names]
    others = [name for name, match in zip(names, found, strict=True) if match is None]
    if others:
        raise InputError(
            "names of the points",
            "vertices, such as v1204",
            repr(others[0]),
            "Give the vertex of each point with --map, or take the nearest ones with --auto.",
        )
    return np.array([int(match[1]) for match in found if match], dtype=np.int64)


def mapped_vertices(table: Mapping[str, object], names: Sequence[str]) -> tuple[IntArray, IntArray]:
    """The points that a map names, and their vertices.

    Parameters
    ----------
    table : mapping
        Vertex of each point by its name, in any spelling.
    names : sequence of str
        Names of all points; those that the map leaves out are not used.

    Returns
    -------
    points, vertices : arrays of int, shape (M,)

    Raises
    ------
    InputError
        For a vertex that is no whole number, or a name that is not among the points.
    """
    for name, vertex in table.items():
        if isinstance(vertex, bool) or not isinstance(vertex, int):
            raise InputError(
                f"--map: {name}", "the number of a vertex", f"{vertex!r}", "As in chin = 1204."
            )
    if not table:
        raise InputError("--map", "lines such as chin = 1204", "none", "Name some points.")
    vertices = np.array(list(table.values()), dtype=np.int64)
    return match(list(table), names, "--map: points of the take"), vertices


def nearest_vertices(rest: FloatArray, vertices: FloatArray) -> IntArray:
    """The vertex nearest to each point at rest, (M,).

    Parameters
    ----------
    rest : array, shape (M, 3)
        Points at rest, in the mesh's space and units.
    vertices : array, shape (V, 3)

    Raises
    ------
    InputError
        When points lie far from the mesh, or share a vertex.
    """
    distance, found = map(np.asarray, cKDTree(vertices).query(rest))
    _require_near(distance, vertices)
    unique, counts = np.unique(found, return_counts=True)
    if (counts > 1).any():
        raise InputError(
            "--auto",
            "a vertex for each point",
            f"vertex {unique[counts > 1][0]} nearest to several",
            "Give the vertices with --map.",
        )
    return np.asarray(found, dtype=np.int64)


def carried_over(points: FloatArray, rest: FloatArray, home: FloatArray, fit: Fit) -> FloatArray:
    """Points of one face as points of another: home + s (points - rest).

    Parameters
    ----------
    points : array, shape (T, M, 3)
    rest : array, shape (M, 3)
        The points when the face they come from rests.
    home : array, shape (M, 3)
        Positions of the points' vertices on the neutral of the other face.
    fit : {"uniform", "axes"}
        Whether s is the ratio of the faces' sizes over all axes, or for each alone.

    Raises
    ------
    InputError
        When the points do not extend along an axis that is to be scaled.
    """
    sizes = [np.std(each, axis=0) for each in (rest, home)]
    if fit == "uniform":
        sizes = [np.full(3, np.linalg.norm(size)) for size in sizes]
    if not (sizes[0] > 0).all():
        raise InputError("--fit", "points that spread in space", "flat ones", "Use uniform.")
    return np.asarray(home + sizes[1] / sizes[0] * (points - rest))


def _require_near(distance: FloatArray, vertices: FloatArray) -> None:
    """Refuse points that, by their distances (M,), are not of this face."""
    radius = float(np.sqrt(np.mean(np.sum((vertices - vertices.mean(axis=0)) ** 2, axis=1))))
    if np.median(distance) > FAR * radius:
        raise InputError(
            "points",
            "positions on the mesh when it rests",
            f"half of them farther than {np.median(distance):.3g} from it",
            "For another face's points, or other units, give --map (or v1204-names) and --fit.",
        )
