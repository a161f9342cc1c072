"""A shaded picture of a triangle mesh, without display or graphics card."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_fill_holes, uniform_filter

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.rig import CLAY, require_extent
from facert.mesh.normals import vertex_normals
from facert.render.raster import Surface, rasterise

DARK = np.array([0.13, 0.05, 0.05])  # the inside of a mesh, as seen through an open mouth
VIEW = np.array([0.0, 0.0, 1.0])
KEY_LIGHT = np.array([-0.42, 0.52, 0.74])
WARM, COOL = np.array([1.0, 0.96, 0.90]), np.array([0.75, 0.85, 1.0])
RIM_LIGHT = np.array([0.85, 0.25, -0.35])
_SMOOTHING = 2  # pixels drawn a side for each pixel shown


@dataclass(frozen=True)
class Camera:
    """A view along -z without perspective: what is in its centre, and half the height shown.

    `yaw` turns the face towards its own left, in radians.
    """

    centre: tuple[float, float, float]
    reach: float
    yaw: float = 0.0

    def project(self, vertices: FloatArray, size: int) -> FloatArray:
        """Column, row (pixels) and depth (V, 3)."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        turn = np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
        seen = (vertices - self.centre) @ turn
        scale = size / (2 * self.reach)
        return np.column_stack(
            [
                (size - 1) / 2 + scale * seen[:, 0],
                (size - 1) / 2 - scale * seen[:, 1],
                seen[:, 2],
            ]
        )


def frame_mesh(vertices: FloatArray, yaw: float = 0.0) -> Camera:
    """A camera that shows a whole mesh (V, 3) with a little air around it.

    Raises `InputError` when all of it lies in one place, as seen from the front.
    """
    require_extent(vertices[:, :2])
    return frame_points(vertices, yaw)


def frame_points(points: FloatArray, yaw: float = 0.0) -> Camera:
    """A camera that shows points (V, 3) with a little air around them; its reach may be 0."""
    low, high = points.min(axis=0), points.max(axis=0)
    x, y, z = (low + high) / 2
    return Camera((x, y, z), 0.53 * float((high - low)[:2].max()), yaw)


def shade(
    vertices: FloatArray,
    faces: IntArray,
    camera: Camera,
    size: int = 320,
    colours: FloatArray | None = None,
) -> FloatArray:
    """Picture (size, size, 4), RGBA from 0 to 1, of a mesh (V, 3) with triangles (F, 3)."""
    if colours is None:
        colours = np.tile(CLAY, (len(vertices), 1))
    fine = size * _SMOOTHING
    pixels = camera.project(vertices, fine)
    turned = pixels * [1, -1, fine / (2 * camera.reach)]
    surface = rasterise(pixels, vertex_normals(turned, faces), colours, faces, fine)
    cell = _cells(surface.covered, size)
    holes = _cells(binary_fill_holes(surface.covered) & ~surface.covered, size)
    cover = _mean(cell, 1.0, size)
    light = _light(surface, 1 - _occlusion(surface.depth, cell, size, camera.reach)[cell])
    dark = _mean(holes, 1.0, size)  # holes in a mask show the dark behind it
    picture = np.stack([_mean(cell, part, size) for part in light] + [cover + dark], axis=1)
    picture[:, :3] += dark[:, None] * DARK
    picture[:, :3] /= np.maximum(picture[:, 3:], 1e-9)
    return np.asarray(np.clip(picture, 0, 1)).reshape(size, size, 4)


def _cells(chosen: BoolArray, size: int) -> IntArray:
    """Index of the picture's pixel that each chosen pixel of the finer drawing lies in, (n,)."""
    row, column = np.divmod(np.flatnonzero(chosen), chosen.shape[1])
    return np.asarray(row // _SMOOTHING * size + column // _SMOOTHING)


def _mean(cell: IntArray, values: FloatArray | float, size: int) -> FloatArray:
    """Mean of values (n,) over the fine pixels of each pixel; what is not covered counts as 0."""
    weights = np.broadcast_to(values, cell.shape) / _SMOOTHING**2
    return np.bincount(cell, weights, size * size).astype(np.float64)


def _light(surface: Surface, open_sky: FloatArray) -> FloatArray:
    """Colours (3, n) of the covered pixels under a warm key light, sky, rim and soft shadow."""
    normal = surface.normal
    key = 0.80 * np.clip(0.5 * (_unit(KEY_LIGHT) @ normal) + 0.5, 0, 1) ** 2
    cool = 0.36 * (0.5 + 0.5 * normal[1])
    cool += 0.25 * np.clip(_unit(RIM_LIGHT) @ normal, 0, 1) ** 2
    cool += 0.25 * 0.35 * (1 - np.clip(normal[2], 0, 1)) ** 4
    gloss = np.clip(_unit(_unit(KEY_LIGHT) + VIEW) @ normal, 0, 1) ** 60
    light = (0.12 + WARM[:, None] * key + COOL[:, None] * cool) * open_sky
    colour = surface.colour * light + 0.10 * gloss * open_sky
    inside = surface.inside
    colour[:, inside] = DARK[:, None] * (0.4 + 0.6 * light[:, inside])
    return np.asarray(colour)


def _occlusion(fine_depth: FloatArray, cell: IntArray, size: int, reach: float) -> FloatArray:
    """Share of the sky that the surroundings hide, (size * size,).

    A hollow lies behind the mean depth around it.
    """
    cover = _mean(cell, 1.0, size).reshape(size, size)
    depth = _mean(cell, fine_depth, size).reshape(size, size)
    own = depth / np.maximum(cover, 1e-6)
    hidden = np.zeros_like(depth)
    for width in (0.012, 0.04):
        sigma = width * size
        near = _blur(cover, sigma)
        mean = _blur(depth, sigma) / np.maximum(near, 1e-6)
        hollow = np.clip((mean - own) / (reach * width * 4.5), 0, 0.5)
        hidden += hollow * np.clip(2 * near - 1, 0, 1)  # an outline is no hollow
    return np.asarray(np.clip(hidden, 0, 0.75).ravel())


def _blur(image: FloatArray, sigma: float) -> FloatArray:
    """Approximate Gaussian blur: two box filters, whose cost does not grow with width."""
    width = max(1, round(2.45 * sigma))
    return np.asarray(uniform_filter(uniform_filter(image, width), width))


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
