"""The feature points of a take, ready to drive a face: each with its vertex, in every frame."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import Mesh
from facert.data.take import Take
from facert.errors import InputError
from facert.models.gaussian import fill_gaps
from facert.topology.labels import checked_labels
from facert.topology.placement import (
    Fit,
    carried_over,
    mapped_vertices,
    named_vertices,
    nearest_vertices,
    require_near,
)

Where = Mapping[str, object] | Literal["names", "nearest"]

log = logging.getLogger("facert")


@dataclass(frozen=True, eq=False)
class FeaturePoints:
    """Points that a face follows.

    Parameters
    ----------
    vertices : array of int, shape (M,)
        The vertex of each.
    positions : array, shape (T, M, 3)
        In the space and units of the mesh, without gaps.
    """

    vertices: IntArray
    positions: FloatArray


def feature_points(
    take: Take,
    mesh: Mesh,
    where: Where = "names",
    rest: int = 0,
    fit: Fit = "none",
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
        How markers of another face are carried over.

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
    positions = _without_gaps(take.source.values[:, seen])
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
        require_near(np.linalg.norm(positions[rest] - home, axis=1), mesh.vertices)
    return FeaturePoints(vertices, carried_over(positions, positions[rest], home, fit))


def _without_gaps(positions: FloatArray) -> FloatArray:
    flat = positions.reshape(len(positions), -1)
    hidden = int(np.isnan(flat).sum()) // 3
    if hidden:
        log.info("%d of %d positions were hidden: filled", hidden, flat.size // 3)
    return fill_gaps(flat).reshape(positions.shape)
