"""The skin: loops of vertices around the eye and the mouth, and a sheet that fills the rest.

The loops follow the anatomy, so that lids close and lips part along rows of vertices. The rest is
triangulated in a map of the head that keeps distances from the tip of the nose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.demo.build import Build
from facert.demo.parts import FORWARD, ORIGIN, Patch, cast_from_front, cast_from_inside, strips

INSIDE = (0.16, 0.05, 0.06)
LASHES = (0.20, 0.11, 0.09)
GUM = (0.42, 0.16, 0.16)
_REACH = 2.8  # radians from the tip of the nose to the edge of the sheet, behind the head


@dataclass(frozen=True, eq=False)
class Skin:
    """The left half of the skin."""

    piece: Patch
    lids: IntArray
    """Loops around the eye, from the inner edge of the lids outwards; a loop starts at the outer
    corner and runs over the upper lid. Shape (4, n)."""
    lips: IntArray
    """Rows of the mouth from the inside outwards; a row starts in the middle of the upper lip.
    Shape (8, 2 k + 1)."""


LID_EDGE = 1  # row of `Skin.lids` that bounds the opening
LIP_EDGE = 3  # row of `Skin.lips` where the lips meet
LIP_BORDER = 5


def skin(build: Build) -> Skin:
    """Lids, lips and everything between them."""
    lids, lips = _lids(build), _lips(build)
    sheet = _sheet(build, avoid=np.vstack([lids[-1], lips[-1]]), loops=(lids[-1], lips[-1]))
    vertices = np.vstack([lids.reshape(-1, 3), lips.reshape(-1, 3), sheet])
    lid_grid = np.arange(lids.shape[0] * lids.shape[1]).reshape(lids.shape[:2])
    lip_grid = lid_grid.size + np.arange(lips.shape[0] * lips.shape[1]).reshape(lips.shape[:2])
    rest = np.concatenate(
        [lid_grid[-1], lip_grid[-1], np.arange(lid_grid.size + lip_grid.size, len(vertices))]
    )
    faces = np.vstack(
        [
            strips(lid_grid[::-1], closed=True),
            strips(lip_grid),
            _back_of_mouth(lip_grid[0]),
            _triangulate(vertices, rest, (lid_grid[-1], lip_grid[-1])),
        ]
    )
    piece = Patch(vertices, faces, _colours(vertices, lid_grid, lip_grid, build))
    return Skin(piece, lid_grid, lip_grid)


def _lids(build: Build) -> FloatArray:
    """Loops (4, n, 3): inside of the lids, their edge, the lid, the rim of the socket."""
    eye, turn = build.eye, np.linspace(0, 2 * np.pi, build.lid_points, endpoint=False)
    across, height = np.cos(turn), np.sin(turn)
    opening = np.where(height > 0, eye.upper, eye.lower) * height
    rim = np.where(height > 0, 0.75 * eye.upper + 0.62, 0.85 * eye.lower + 0.5) * height
    widths = np.array([1.0, 1.0, 1.13, 1.36])
    blends = np.array([0.0, 0.0, 0.45, 1.0])[:, None]
    x = eye.width * widths[:, None] * across
    y = opening + blends * (rim - opening) + eye.tilt * x
    points = np.stack([x + eye.centre[0], y + eye.centre[1]], axis=-1)
    loops = cast_from_front(points.reshape(-1, 2), build.blobs).reshape(4, -1, 3)
    loops[0] += (np.array(eye.centre) - loops[0]) * 0.16
    crease = np.where(height > 0.2, 0.10, 0.0)
    loops[1, :, 2] += 0.06
    loops[2, :, 2] += 0.07 - crease * 0.2
    loops[3, :, 2] -= crease
    return loops


def _lips(build: Build) -> FloatArray:
    """Rows (8, 2 k + 1, 3): back of the mouth ... where the lips meet ... border ... cheek."""
    mouth, count = build.mouth, 2 * build.lip_points + 1
    turn = np.linspace(0, np.pi, count)
    across, height = np.sin(turn), np.cos(turn)
    across[[0, -1]], height[build.lip_points] = 0.0, 0.0
    upper = np.arange(count) < build.lip_points
    line = mouth.curve * mouth.width * (across**2 - 0.35)  # the closed mouth
    bow = 1 - 0.22 * np.exp(-((across / 0.16) ** 2))  # dip of the upper lip
    lip = np.where(upper, mouth.upper * bow, mouth.lower) * height
    skin_height = np.where(upper, mouth.upper + 0.62, mouth.lower + 0.85) * height
    #                   back   bag    tuck  edge  swell border cheek cheek
    widths = np.array([0.70, 0.80, 0.95, 1.0, 1.02, 1.06, 1.22, 1.42])
    heights = np.stack(
        [
            0.9 * height,
            0.7 * height,
            0.02 * height,
            0 * lip,
            0.5 * lip,
            lip,
            lip + 0.45 * (skin_height - lip),
            skin_height,
        ]
    )
    swell = mouth.fullness * np.array([0, 0, 0.1, 0.42, 1.0, 0.25, -0.05, 0])
    depth = np.array([3.0, 1.4, 0.45, 0, 0, 0, 0, 0])
    x = mouth.width * widths[:, None] * across
    y = mouth.centre[1] + line + heights
    rows = cast_from_front(np.stack([x, y], -1).reshape(-1, 2), build.blobs).reshape(8, count, 3)
    rows[..., 2] += swell[:, None] * (1 - across**4) - depth[:, None]
    rows[:, [0, -1], 0] = 0
    return rows


def _sheet(build: Build, avoid: FloatArray, loops: tuple[FloatArray, ...]) -> FloatArray:
    """Vertices of the rest (n, 3): rings around the tip of the nose, wider apart further out."""
    rings = [np.zeros((1, 2))]
    radius = build.spacing
    while radius < _REACH:
        step = build.spacing * (1 + 1.1 * radius)
        turn = np.linspace(-np.pi / 2, np.pi / 2, int(np.ceil(np.pi * radius / step)) + 1)
        ring = radius * np.column_stack([np.cos(turn), np.sin(turn)])
        ring[[0, -1], 0] = 0
        rings.append(ring)
        radius += step
    flat = np.vstack(rings)
    keep = cKDTree(_flatten(avoid)).query(flat)[0] > 0.7 * build.spacing
    for loop in loops:
        centre, outline = _flatten(loop).mean(axis=0), _flatten(loop)
        keep &= ~_encloses(outline, flat, centre)
    vertices = cast_from_inside(_unflatten(flat[keep]), build.blobs)
    vertices[flat[keep][:, 0] == 0, 0] = 0
    return vertices


def _triangulate(vertices: FloatArray, rest: IntArray, loops: tuple[IntArray, ...]) -> IntArray:
    """Delaunay triangles of the sheet, without those that fill a loop."""
    faces = rest[Delaunay(_flatten(vertices[rest])).simplices]
    keep = np.ones(len(faces), dtype=bool)
    for loop in loops:
        keep &= ~np.isin(faces, loop).all(axis=1)
    faces = faces[keep]
    flat = _flatten(vertices)[faces]
    ab, ac = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    faces = faces[np.abs(area) > 1e-9]
    clockwise = area[np.abs(area) > 1e-9] < 0
    faces[clockwise] = faces[clockwise][:, ::-1]
    return np.asarray(faces, dtype=np.int64)


def _back_of_mouth(row: IntArray) -> IntArray:
    """Triangles that join the upper half of the innermost row to its lower half."""
    half = len(row) // 2
    faces = strips(np.stack([row[half:][::-1], row[: half + 1]]))
    return np.asarray(faces[faces[:, 1] != faces[:, 2]])  # both halves end in the corner


def _colours(vertices: FloatArray, lids: IntArray, lips: IntArray, build: Build) -> FloatArray:
    """Skin with blush on cheek and nose, lips, and the dark of the mouth."""
    palette = build.palette
    base, blush = np.array(palette.skin), np.array(palette.blush)
    spots = np.array([[*build.cheek, 1.5, 0.55], [0.0, build.nose[1] + 0.2, 0.9, 0.4]])
    distance = np.linalg.norm(vertices[:, None, :2] - spots[:, :2], axis=2) / spots[:, 2]
    shade = (spots[:, 3] * np.exp(-(distance**2))).sum(axis=1) * (vertices[:, 2] > 0)
    colours = base + shade[:, None] * (blush - base)
    lip = np.array(palette.lips)
    for row, tint in enumerate([INSIDE, INSIDE, GUM, 0.75 * lip, lip, 0.5 * (lip + base)]):
        colours[lips[row]] = tint
    half = lids.shape[1] // 2
    colours[lids[:2]] = 0.6 * base + 0.4 * lip
    colours[lids[:2, : half + 1]] = LASHES
    return np.asarray(colours)


def _flatten(points: FloatArray) -> FloatArray:
    """The map (n, 2) of points (n, 3): direction and angle from the tip of the nose."""
    directions = (points - ORIGIN) / np.linalg.norm(points - ORIGIN, axis=1, keepdims=True)
    plane = directions @ np.array([[1.0, 0.0, 0.0], np.cross(FORWARD, [1.0, 0.0, 0.0])]).T
    length = np.linalg.norm(plane, axis=1)
    angle = np.arctan2(length, directions @ FORWARD)
    return np.asarray(plane * (angle / np.maximum(length, 1e-12))[:, None])


def _unflatten(flat: FloatArray) -> FloatArray:
    """Unit directions (n, 3) of points of the map (n, 2)."""
    angle = np.linalg.norm(flat, axis=1, keepdims=True)
    plane = flat / np.maximum(angle, 1e-12)
    axes = np.array([[1.0, 0.0, 0.0], np.cross(FORWARD, [1.0, 0.0, 0.0])])
    return np.asarray(np.cos(angle) * FORWARD + np.sin(angle) * (plane @ axes))


def _encloses(outline: FloatArray, points: FloatArray, centre: FloatArray) -> BoolArray:
    """Whether a convex outline holds each point: no farther from its centre than the outline."""
    around, ours = outline - centre, points - centre
    order = np.argsort(np.arctan2(around[:, 1], around[:, 0]))
    angles = np.arctan2(around[:, 1], around[:, 0])[order]
    radii = np.linalg.norm(around, axis=1)[order]
    reach = np.interp(np.arctan2(ours[:, 1], ours[:, 0]), angles, radii, period=2 * np.pi)
    return np.asarray(np.linalg.norm(ours, axis=1) < reach)
