"""A shaded picture of a triangle mesh, without display or graphics card."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_fill_holes, uniform_filter

from facert.data import FloatArray, IntArray
from facert.view.raster import Surface, rasterise, vertex_normals

CLAY = (0.80, 0.72, 0.66)
DARK = np.array([0.13, 0.05, 0.05])  # the inside of a mesh, as seen through an open mouth
VIEW = np.array([0.0, 0.0, 1.0])
KEY_LIGHT = np.array([-0.42, 0.52, 0.74])
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
    """A camera that shows a whole mesh (V, 3) with a little air around it."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
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
    filled = binary_fill_holes(surface.covered)
    colour = _light(surface, fine, camera.reach)
    colour[filled & ~surface.covered] = DARK  # holes in a mask show the dark behind it
    picture = np.dstack([colour, filled])
    picture[..., :3] *= picture[..., 3:]
    picture = picture.reshape(size, _SMOOTHING, size, _SMOOTHING, 4).mean(axis=(1, 3))
    picture[..., :3] /= np.maximum(picture[..., 3:], 1e-9)
    return np.asarray(np.clip(picture, 0, 1))


def _light(surface: Surface, size: int, reach: float) -> FloatArray:
    """Colours (H, W, 3) under a warm key light, sky, a cool rim light, and soft shadow."""
    normal = surface.normal
    key = np.clip(0.5 * (normal @ _unit(KEY_LIGHT)) + 0.5, 0, 1) ** 2
    sky = 0.5 + 0.5 * normal[..., 1]
    rim = np.clip(normal @ _unit(RIM_LIGHT), 0, 1) ** 2
    facing = np.clip(normal[..., 2], 0, 1)
    rim += 0.35 * (1 - facing) ** 4
    gloss = np.clip(normal @ _unit(_unit(KEY_LIGHT) + VIEW), 0, 1) ** 60
    open_sky = 1 - _occlusion(surface, size, reach)
    warm, cool = np.array([1.0, 0.96, 0.90]), np.array([0.75, 0.85, 1.0])
    light = (0.12 + 0.80 * key[..., None] * warm + 0.36 * sky[..., None] * cool) * open_sky[
        ..., None
    ]
    light += 0.25 * rim[..., None] * cool * open_sky[..., None]
    colour = surface.colour * light + 0.10 * (gloss * open_sky)[..., None]
    inside = DARK * (0.4 + 0.6 * light)
    return np.asarray(np.where(surface.inside[..., None], inside, colour))


def _occlusion(surface: Surface, size: int, reach: float) -> FloatArray:
    """How much of the sky the surroundings hide (H, W): hollows lie behind their mean depth."""
    hidden = np.zeros_like(surface.depth)
    cover = surface.covered.astype(float)
    for width in (0.012, 0.04):
        sigma = width * size
        near = _blur(cover, sigma)
        mean = _blur(surface.depth * cover, sigma) / np.maximum(near, 1e-6)
        hollow = np.clip((mean - surface.depth) / (reach * width * 4.5), 0, 0.5)
        hidden += hollow * np.clip(2 * near - 1, 0, 1)  # an outline is no hollow
    return np.asarray(np.clip(hidden, 0, 0.75) * cover)


def _blur(image: FloatArray, sigma: float) -> FloatArray:
    """Nearly a Gaussian: two box filters, whose cost does not grow with their width."""
    width = max(1, round(2.45 * sigma))
    return np.asarray(uniform_filter(uniform_filter(image, width), width))


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
