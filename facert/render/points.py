"""Feature points drawn on a face."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import IntArray
from facert.data.rig import Mesh
from facert.render.shade import frame_mesh, shade

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INCHES, RESOLUTION = 4.5, 150
TURNS = (0.0, -0.9)  # radians: from the front, and from the side
INK = "#b3261e"


def draw_points(mesh: Mesh, vertices: IntArray) -> Figure:
    """A face from the front and from the side, with the place of each point among them.

    Parameters
    ----------
    mesh : Mesh
    vertices : array of int, shape (M,)
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(INCHES * len(TURNS), INCHES), dpi=RESOLUTION)
    size = round(INCHES * RESOLUTION)
    grid = figure.subplots(1, len(TURNS), squeeze=False, gridspec_kw=_no_margins())
    for axes, turn in zip(grid.flat, TURNS, strict=True):
        camera = frame_mesh(mesh.vertices, turn)
        axes.imshow(shade(mesh.vertices, mesh.faces, camera, size, mesh.colours))
        column, row, depth = camera.project(mesh.vertices, size)[vertices].T
        for place in np.argsort(depth):  # nearer ones over farther ones
            axes.plot(column[place], row[place], "o", ms=4, color=INK, mec="white", mew=0.5)
            axes.annotate(
                str(place + 1),
                (column[place], row[place]),
                (3, 2),
                "data",
                "offset points",
                fontsize=5,
                color=INK,
            )
        axes.set_axis_off()
    return figure


def _no_margins() -> dict[str, float]:
    return {"left": 0, "right": 1, "bottom": 0, "top": 1, "wspace": 0}
