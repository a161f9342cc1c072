"""A whole head: the left half and its mirror image in one mesh; and where it wears markers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from facert.data.arrays import FloatArray, IntArray
from facert.demo import parts
from facert.demo.build import Build
from facert.demo.parts import Patch, cast_from_front
from facert.demo.skin import LID_EDGE, LIP_BORDER, LIP_EDGE, skin

# Markers in front view, in cm; the sided ones are given for the left half.
MIDDLE = {
    "forehead": (0.0, 5.2),
    "nose_bridge": (0.0, 0.3),
    "nose_tip": (0.0, -2.3),
    "philtrum": (0.0, -4.1),
    "below_lip": (0.0, -6.4),
    "chin": (0.0, -7.8),
}
SIDED = {
    "forehead": (2.8, 5.0),
    "temple": (5.9, 1.6),
    "brow_inner": (1.4, 2.5),
    "brow_middle": (3.2, 3.1),
    "brow_outer": (4.8, 2.6),
    "below_eye": (3.1, -0.6),
    "nose_wing": (1.45, -2.7),
    "nasolabial": (2.2, -3.4),
    "cheek_upper": (3.6, -1.6),
    "cheek_outer": (5.1, -1.4),
    "cheek_lower": (4.2, -3.6),
    "chin_side": (1.7, -7.3),
    "jaw": (4.0, -5.9),
}


@dataclass(frozen=True, eq=False)
class Head:
    """A head at rest."""

    build: Build
    vertices: FloatArray
    """Positions in cm, (V, 3)."""
    faces: IntArray
    """Triangles, anticlockwise seen from outside, (F, 3)."""
    colours: FloatArray
    """RGB of the vertices, (V, 3)."""
    tissue: IntArray
    """A `parts.Tissue` a vertex, (V,)."""
    mirror: IntArray
    """The vertex on the other side; itself on the midline. Shape (V,)."""
    lids: IntArray
    lips: IntArray
    """Loops of the left half, see `skin.Skin`."""
    pieces: Mapping[str, IntArray]
    """Vertices of the left half by the piece."""


def make_head(build: Build, inner: bool = False) -> Head:
    """Model a head from its proportions; with `inner`, tongue, gums and eyeballs to turn."""
    face = skin(build)
    upper, lower = parts.teeth(build, inner)
    pieces = {
        "skin": face.piece,
        "eyeball": parts.eyeball(build, inner),
        "brow": parts.brow(build),
        "upper teeth": upper,
        "lower teeth": lower,
        "ear": parts.ear(build),
        "hair": parts.hair(build),
    } | ({"tongue": parts.tongue(build)} if inner else {})
    half, tissue = _join(list(pieces.values()))
    ends = np.cumsum([len(piece.vertices) for piece in pieces.values()])
    middle = np.abs(half.vertices[:, 0]) < 1e-9
    count = len(half.vertices)
    mirror = np.arange(count)
    mirror[~middle] = count + np.arange((~middle).sum())
    other = half.vertices[~middle] * [-1.0, 1.0, 1.0]
    return Head(
        build,
        np.vstack([half.vertices, other]),
        np.vstack([half.faces, mirror[half.faces][:, ::-1]]),
        np.vstack([half.colours, half.colours[~middle]]),
        np.concatenate([tissue, tissue[~middle]]),
        np.concatenate([mirror, np.flatnonzero(~middle)]),
        face.lids,
        face.lips,
        dict(zip(pieces, np.split(np.arange(count), ends[:-1]), strict=True)),
    )


def _join(pieces: list[Patch]) -> tuple[Patch, IntArray]:
    """Join pieces into one, and the tissue of each vertex."""
    starts = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
    joined = Patch(
        np.vstack([piece.vertices for piece in pieces]),
        np.vstack([piece.faces + start for piece, start in zip(pieces, starts, strict=False)]),
        np.vstack([piece.colours for piece in pieces]),
    )
    return joined, np.repeat([piece.tissue for piece in pieces], np.diff(starts)).astype(np.int64)


def marker_vertices(head: Head) -> tuple[tuple[str, ...], IntArray]:
    """Names and vertices of the 44 markers on the actor's head."""
    half_lid, half_lip = head.lids.shape[1] // 2, head.lips.shape[1] // 2
    edge, border = head.lids[LID_EDGE], head.lips[LIP_BORDER]
    middle = _nearest(head, MIDDLE) | {"lip_upper": border[0], "lip_lower": border[-1]}
    left = _nearest(head, SIDED) | {
        "lid_upper": edge[half_lid // 2],
        "lid_lower": edge[half_lid + half_lid // 2],
        "lip_upper": border[half_lip // 2],
        "lip_lower": border[half_lip + (half_lip + 1) // 2],
        "lip_corner": head.lips[LIP_EDGE, half_lip],
    }
    named = dict(middle)
    for name, vertex in left.items():
        named |= {f"{name}_L": vertex, f"{name}_R": head.mirror[vertex]}
    return tuple(named), np.array(list(named.values()), dtype=np.int64)


def _nearest(head: Head, spots: dict[str, tuple[float, float]]) -> dict[str, int]:
    """The vertex on the skin that is nearest to each spot."""
    on_skin = cast_from_front(np.array(list(spots.values())), head.build.blobs)
    vertices = np.asarray(cKDTree(head.vertices).query(on_skin)[1], dtype=np.int64)
    return dict(zip(spots, vertices.tolist(), strict=True))
