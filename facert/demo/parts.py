"""The pieces of a head: patches of triangles, left half, made from the proportions alone.

The skin is the zero of a field: ellipsoids of clay, joined by soft seams.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from facert.data.arrays import FloatArray, IntArray
from facert.demo.build import Blob, Build, Colour

ORIGIN = np.array([0.0, 1.0, 0.0])  # inside of the head; every point of the skin is seen from here
FORWARD = np.array([0.0, -0.36, 0.933])  # from there to the tip of the nose
_FAR = 40.0
_BISECTIONS = 48  # 40 cm / 2^48: as fine as float64 allows
WHITE: Colour = (0.95, 0.93, 0.90)
TOOTH: Colour = (0.93, 0.90, 0.83)
GUMS: Colour = (0.66, 0.33, 0.33)
TONGUE: Colour = (0.74, 0.36, 0.37)
PUPIL: Colour = (0.04, 0.03, 0.04)


def field(points: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """Roughly the distance to the skin (...,) of points (..., 3): negative inside.

    The head is symmetric, so blobs are given for the left side only.
    """
    points = np.concatenate([np.abs(points[..., :1]), points[..., 1:]], axis=-1)
    distance = _ellipsoid(points, blobs[0])
    for blob in blobs[1:]:
        other = _ellipsoid(points, blob)
        if blob.dig:
            distance = -_soft_minimum(-distance, other, blob.blend)
        else:
            distance = _soft_minimum(distance, other, blob.blend)
    return distance


def cast_from_inside(directions: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """Points where rays from inside the head leave the skin, (n, 3), for directions (n, 3)."""
    return _bisect(np.broadcast_to(ORIGIN, directions.shape), ORIGIN + _FAR * directions, blobs)


def cast_from_front(points: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """The skin behind the points (n, 2) of the front view, (n, 3)."""
    inside = np.column_stack([points, np.zeros(len(points))])
    return _bisect(inside, inside + np.array([0.0, 0.0, _FAR]), blobs)


def _bisect(inside: FloatArray, outside: FloatArray, blobs: Sequence[Blob]) -> FloatArray:
    """The zero of the field between points inside and outside of the head."""
    for _ in range(_BISECTIONS):
        middle = (inside + outside) / 2
        out = field(middle, blobs)[:, None] > 0
        inside, outside = np.where(out, inside, middle), np.where(out, middle, outside)
    return (inside + outside) / 2


def _ellipsoid(points: FloatArray, blob: Blob) -> FloatArray:
    scaled = (points - blob.centre) / blob.radii
    radius = np.sqrt(np.einsum("...i,...i", scaled, scaled))
    scaled /= blob.radii
    slope = np.sqrt(np.einsum("...i,...i", scaled, scaled))
    return np.asarray(radius * (radius - 1) / np.maximum(slope, 1e-9))


def _soft_minimum(a: FloatArray, b: FloatArray, blend: float) -> FloatArray:
    overlap = np.maximum(blend - np.abs(a - b), 0) / blend
    return np.asarray(np.minimum(a, b) - overlap**2 * blend / 4)


class Tissue(IntEnum):
    """Kind of vertex by how it moves: skin moves, others are fixed to the skull or the jaw."""

    SKIN = 0
    SKULL = 1
    JAW = 2


@dataclass(frozen=True, eq=False)
class Patch:
    """A patch: vertices (V, 3), triangles (F, 3) seen anticlockwise, colours (V, 3)."""

    vertices: FloatArray
    faces: IntArray
    colours: FloatArray
    tissue: Tissue = Tissue.SKIN


def strips(grid: IntArray, *, closed: bool = False) -> IntArray:
    """Triangles between the neighbouring rows of a grid of vertex indices (R, n).

    Anticlockwise when the columns run anticlockwise and the rows inwards; `closed` joins the
    last column to the first.
    """
    if closed:
        grid = np.column_stack([grid, grid[:, 0]])
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return np.asarray(faces.reshape(-1, 3), dtype=np.int64)


def grid_patch(
    points: FloatArray,
    colours: ArrayLike,
    tissue: Tissue = Tissue.SKIN,
    *,
    order: slice | tuple[slice, slice] = np.s_[:],
    closed: bool = False,
) -> Patch:
    """A patch of a grid of points (R, n, 3), in one colour or one a vertex; see `strips`.

    `order` takes rows or columns backwards where they run the other way.
    """
    vertices = points.reshape(-1, 3)
    grid = np.arange(len(vertices)).reshape(points.shape[:2])
    painted = np.array(np.broadcast_to(colours, vertices.shape), dtype=np.float64)
    return Patch(vertices, strips(grid[order], closed=closed), painted, tissue)


def eyeball(build: Build, turns: bool = False) -> Patch:
    """Rings around the line of sight, with pupil, iris and white; more if it turns."""
    eye, sides = build.eye, 20
    edge = 0.02
    angles = np.array(
        [0.0, eye.pupil - edge, eye.pupil + edge, eye.iris - edge, eye.iris + edge, 0.8, 1.1, 1.5]
        + ([1.9, 2.3] if turns else [])
    )
    iris = np.array(build.palette.iris)
    colours = np.array([PUPIL, PUPIL, iris, 0.55 * iris] + [WHITE] * (len(angles) - 4))
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    radius, depth = np.sin(angles[1:, None]), np.cos(angles[1:, None]) + 0 * turn
    rings = np.stack([radius * np.cos(turn), radius * np.sin(turn), depth], axis=-1)
    directions = np.vstack([[[0.0, 0.0, 1.0]], rings.reshape(-1, 3)])
    grid = 1 + np.arange(rings.shape[0] * sides).reshape(-1, sides)
    fan = np.column_stack([np.zeros(sides, dtype=int), grid[0], np.roll(grid[0], -1)])
    return Patch(
        directions * eye.ball + eye.centre,
        np.vstack([fan, strips(grid[::-1], closed=True)]),
        np.vstack([colours[:1], np.repeat(colours[1:], sides, axis=0)]),
        Tissue.SKULL,
    )


def brow(build: Build) -> Patch:
    """A ribbon of hair that lies on the skin."""
    shape = build.brow
    along = np.linspace(0, 1, 12)[:, None]
    ends = np.array([shape.inner, shape.arch, shape.outer])
    # A parabola through the inner end (0), the highest point (0.6) and the outer end (1).
    line = (
        ends[0] * (along - 0.6) * (along - 1) / 0.6
        - ends[1] * along * (along - 1) / 0.24
        + ends[2] * along * (along - 0.6) / 0.4
    )
    width = shape.thickness * np.minimum(1, 0.55 + 3 * along) * np.minimum(1, 2.2 * (1.08 - along))
    rows = [line - width * step * np.array([0.0, 1.0]) for step in (1.0, 0.35, -0.35, -1.0)]
    flat = np.concatenate(rows)
    skin = cast_from_front(flat, build.blobs)
    outwards = (skin - ORIGIN) / np.linalg.norm(skin - ORIGIN, axis=1, keepdims=True)
    lift = np.repeat([-0.05, 0.16, 0.16, -0.05], len(along))[:, None]
    return grid_patch((skin + lift * outwards).reshape(4, -1, 3), build.palette.hair)


def teeth(build: Build, gums: bool = False) -> tuple[Patch, Patch]:
    """The upper row on the skull and the lower row on the jaw; with `gums`, wider ones."""
    mouth = build.mouth
    x = np.linspace(0, (1.05 if gums else 0.82) * mouth.width, 8)
    front = cast_from_front(np.array([mouth.centre]), build.blobs)[0, 2] - 0.75
    z = front - 0.9 * mouth.width * (x / mouth.width / 1.1) ** 2
    height = mouth.upper + mouth.lower

    def row(top: float, bottom: float, tissue: Tissue) -> Patch:
        levels, colours = [bottom, top], [TOOTH, TOOTH]
        if gums and top > 0:
            levels, colours = [bottom, top, 1.01 * top, 2 * top], [TOOTH, TOOTH, GUMS, GUMS]
        y = mouth.centre[1] + np.array(levels)
        points = np.stack([np.stack([x, np.full_like(x, level), z], -1) for level in y])
        return grid_patch(points, np.repeat(colours, len(x), axis=0), tissue)

    return (
        row(0.5 * height, -0.26 * height, Tissue.SKULL),
        row(-0.22 * height, -0.62 * height, Tissue.JAW),
    )


def tongue(build: Build) -> Patch:
    """The left half of a tongue that lies behind the teeth, from its root to the tip."""
    mouth, rows, sides = build.mouth, 12, 9
    front = cast_from_front(np.array([mouth.centre]), build.blobs)[0, 2]
    along = np.linspace(0, 1, rows)[:, None]
    turn = np.linspace(0, np.pi, sides)  # from the top over the side to below
    girth = np.sqrt(np.maximum(1 - np.maximum((along - 0.5) / 0.5, 0) ** 2.4, 0.01))
    x = 0.40 * mouth.width * girth * np.sin(turn)
    groove = 0.10 * np.exp(-((np.sin(turn) / 0.25) ** 2)) * (np.cos(turn) > 0)
    y = mouth.centre[1] - 0.27 + 0.24 * girth * (np.cos(turn) - groove)
    z = front - 2.75 + 1.65 * along + 0 * turn
    points = np.stack([x, y, z], axis=-1)
    points[:, [0, -1], 0] = 0
    return grid_patch(points, TONGUE, Tissue.JAW, order=np.s_[:, ::-1])


def ear(build: Build) -> Patch:
    """A leaf with a hollow, at the side of the head."""
    shape, rows, sides = build.ear, 10, 14
    width, length = shape.reach
    up = np.array([np.sin(shape.lean), np.cos(shape.lean), -0.15])
    up /= np.linalg.norm(up)
    back = np.cross(up, [0.35, 0.0, 0.94])
    back *= np.sign(back[0]) / np.linalg.norm(back)
    front = np.cross(back, up)
    front *= np.sign(front[2])
    level = np.cos(np.linspace(0.06, np.pi - 0.06, rows))[:, None]
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    leaf = np.sqrt(1 - level**2) * (1 - shape.point * 0.42 * (1 + level))
    across, depth = leaf * np.cos(turn), 0.28 * leaf * np.sin(turn)
    hollow = 0.42 * leaf * np.exp(-3 * (across**2 + (level + 0.1) ** 2)) * (depth > 0)
    centre = np.array(shape.root) + np.sin(shape.lean) * length * 0.75 * up
    points = (
        centre
        + width * across[..., None] * back
        + length * (level + 0 * turn)[..., None] * up
        + width * (depth - hollow)[..., None] * front
    )
    right_handed = np.dot(np.cross(back, front), up) > 0
    skin, blush = np.array(build.palette.skin), np.array(build.palette.blush)
    shade = np.clip(hollow * 1.2, 0, 0.8).reshape(-1, 1)
    order = np.s_[:, ::-1] if right_handed else np.s_[:, :]
    return grid_patch(points, skin + shade * (blush - skin), order=order, closed=True)


def hair(build: Build) -> Patch:
    """A cap of hair; its edge dips below the skin, which draws a clean hairline."""
    shape, rows, sides = build.hair, 12, 22
    crown = np.array(shape.crown) / np.linalg.norm(shape.crown)
    left = np.array([1.0, 0.0, 0.0])
    front = np.cross(left, crown)
    turn = np.linspace(-np.pi / 2, np.pi / 2, sides)  # from the neck over the side to the brow
    reach = shape.angle * (1 + 0.10 * shape.parting * np.cos(6 * turn))
    reach *= 1 - shape.crest * np.cos(turn) ** 2
    inwards = np.linspace(1, 0.04, rows)[:, None]
    angle = reach * inwards
    directions = (
        np.cos(angle)[..., None] * crown
        + (np.sin(angle) * np.cos(turn))[..., None] * left
        + (np.sin(angle) * np.sin(turn))[..., None] * front
    )
    skin = cast_from_inside(directions.reshape(-1, 3), build.blobs).reshape(directions.shape)
    locks = 1 + 0.16 * np.sin(13 * turn + 5 * inwards) * inwards
    height = shape.thickness * np.sqrt(1 - inwards**4) * locks - 0.15 * inwards**6
    vertices = skin + height[..., None] * directions
    vertices[:, [0, -1], 0] = 0
    return grid_patch(vertices, build.palette.hair, Tissue.SKULL, order=np.s_[::-1])
