"""Colours of a face on a page: its own few, or a scale of errors.

The browser draws a mesh in one colour, so a face is drawn as a few meshes: each triangle has one
of a few colours (its paint), and those of the same colour are a mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.rig import CLAY, Mesh
from facert.data.text import for_html

MOST = 24  # colours of a face
LEVELS = 10  # of a scale
# From the colour of clay over yellow and red to a dark violet: lightness falls all the way.
_STOPS = np.array(
    [CLAY, (0.98, 0.80, 0.36), (0.95, 0.52, 0.19), (0.80, 0.20, 0.16), (0.36, 0.04, 0.26)]
)


@dataclass(frozen=True, eq=False)
class Paint:
    """Colours of a mesh."""

    palette: FloatArray
    """Red, green and blue, 0 to 1, (K, 3)."""
    paint: IntArray
    """Which of them each triangle has, (F,)."""


def skin(mesh: Mesh) -> Paint:
    """The mesh's own colours, at most `MOST`; clay if it has none."""
    if mesh.colours is None:
        return Paint(np.array([CLAY]), np.zeros(len(mesh.faces), dtype=np.int64))
    from sklearn.cluster import KMeans

    triangles = mesh.colours[mesh.faces].mean(axis=1)
    different = np.unique(triangles, axis=0)
    if len(different) <= MOST:
        return Paint(*np.unique(triangles, axis=0, return_inverse=True))
    found = KMeans(MOST, n_init=1, random_state=0).fit(triangles)
    return Paint(found.cluster_centers_, found.labels_.astype(np.int64))


@dataclass(frozen=True)
class Scale:
    """Colours for distances of vertices."""

    top: float
    """The distance of the last colour, and of all beyond."""
    units: str = ""
    """Units of length."""

    def paint(self, values: FloatArray, faces: IntArray) -> Paint:
        """Colours of triangles (F, 3) by the distances at their vertices, (V,)."""
        mean = values[faces].mean(axis=1) / self.top
        return Paint(heat(), np.clip(LEVELS * mean, 0, LEVELS - 1).astype(np.int64))

    @property
    def legend(self) -> str:
        """The scale as HTML."""
        blocks = "".join(
            f'<span style="flex:1;height:12px;background:{_css(colour)}"></span>'
            for colour in heat()
        )
        ends = f"<span>0</span><span>{self.top / 2:.2g}</span><span>{self.top:.2g}"
        return (
            f'<div style="padding:2px 12px 6px;font-size:12px"><div style="display:flex">{blocks}'
            f'</div><div style="display:flex;justify-content:space-between">{ends} '
            f"{for_html(self.units)}</span></div></div>"
        )

    @classmethod
    def of(cls, values: FloatArray, units: str) -> Scale:
        """A scale that shows nearly all of some distances."""
        top = float(np.percentile(values, 99.5)) if values.size else 0.0
        return cls(_rounded_up(top) if top > 0 else 1.0, units)


def heat() -> FloatArray:
    """The colours of a scale, (LEVELS, 3)."""
    place = np.linspace(0, len(_STOPS) - 1, LEVELS)
    return np.stack([np.interp(place, range(len(_STOPS)), c) for c in _STOPS.T], axis=1)


def _rounded_up(value: float) -> float:
    """The next 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step for step in (1, 2, 5, 10) if step * power >= value * 0.999) * power)


def _css(colour: FloatArray) -> str:
    return "#" + "".join(f"{round(255 * float(part)):02x}" for part in colour)
