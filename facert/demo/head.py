"""A whole head: the pieces of the left half and their mirror images in one mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.demo import parts
from facert.demo.build import Build
from facert.demo.parts import Patch
from facert.demo.skin import skin


@dataclass(frozen=True, eq=False)
class Head:
    """A head at rest.

    Attributes
    ----------
    build : Build
    vertices : array, shape (V, 3)
        In cm.
    faces : array of int, shape (F, 3)
        Triangles, anticlockwise seen from outside.
    colours : array, shape (V, 3)
    tissue : array of int, shape (V,)
        A `parts.Tissue` a vertex.
    mirror : array of int, shape (V,)
        The vertex on the other side; itself on the midline.
    lids, lips : array of int
        Loops of the left half, see `skin.Skin`.
    """

    build: Build
    vertices: FloatArray
    faces: IntArray
    colours: FloatArray
    tissue: IntArray
    mirror: IntArray
    lids: IntArray
    lips: IntArray


def make_head(build: Build) -> Head:
    """Model a head from its proportions."""
    face = skin(build)
    pieces = [
        face.piece,
        parts.eyeball(build),
        parts.brow(build),
        *parts.teeth(build),
        parts.ear(build),
        parts.hair(build),
    ]
    half, tissue = _join(pieces)
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
    )


def _join(pieces: list[Patch]) -> tuple[Patch, IntArray]:
    """One piece out of many, and the tissue of each vertex."""
    starts = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
    joined = Patch(
        np.vstack([piece.vertices for piece in pieces]),
        np.vstack([piece.faces + start for piece, start in zip(pieces, starts, strict=False)]),
        np.vstack([piece.colours for piece in pieces]),
    )
    return joined, np.repeat([piece.tissue for piece in pieces], np.diff(starts)).astype(np.int64)
