"""A contact sheet: the actor in some frames, each with what is written above it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.names import shape_drivers
from facert.data.rig import MeshSequence, Rig
from facert.data.take import Take
from facert.errors import InputError
from facert.render.faces import Face, frame_faces
from facert.render.shade import shade
from facert.render.sheet import checked_frames

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ACROSS = 5  # least pictures in a row, if there are so many
WIDE = 1.6  # width of a large sheet over its height
CELL, HEADING = 2.2, 0.3  # inches
PIXELS = 320
INK = "#3a3f47"


def contact_sheet(
    take: Take, frames: Sequence[int], headings: Sequence[str], rig: Rig | None = None
) -> Figure:
    """The actor in some frames, from the front: as markers, or as the face that weights drive.

    Parameters
    ----------
    take : Take
    frames : sequence of int
    headings : sequence of str
        One a frame.
    rig : Rig, optional
        The actor's, for a take of weights: a shape, or its left and right half, for each that the
        take and the rig have in common.

    Raises
    ------
    InputError
        When there are too many frames, or a take of weights comes without a rig, or markers with
        one.
    """
    from matplotlib.figure import Figure

    require_drawable(take, rig)
    frames = checked_frames(frames, len(take))
    width = min(len(frames), max(ACROSS, math.ceil(math.sqrt(WIDE * len(frames)))))
    height = -(-len(frames) // width)
    figure = Figure((CELL * width, (CELL + HEADING) * height), dpi=PIXELS / CELL)
    grid = list(figure.subplots(height, width, squeeze=False).flat)
    margin = 0.75 * HEADING / ((CELL + HEADING) * height)
    figure.subplots_adjust(0, 0, 1, 1 - margin, wspace=0.02, hspace=HEADING / CELL)
    for axes in grid:
        axes.set_axis_off()
    if rig is None:
        _draw_markers(grid, take.source.values, frames)
    else:
        _draw_face(grid, actor_face(take, rig), frames)
    for axes, heading in zip(grid, headings, strict=False):
        axes.set_title(heading, fontsize=9, color=INK, pad=3)
    return figure


def require_drawable(take: Take, rig: Rig | None) -> None:
    """Check that there is a rig to draw a take of weights, and none for markers.

    Raises
    ------
    InputError
        When there is not.
    """
    if take.source.kind == "markers" and rig is not None:
        raise _misfit("a take of weights", "a take of markers")
    if take.source.kind == "weights" and rig is None:
        raise _misfit("the actor's rig, for a take of weights", "none")


def actor_face(take: Take, rig: Rig) -> Face:
    """The face of an actor whose weights were tracked; a weight that is hidden counts as 0.

    Raises
    ------
    InputError
        When the rig has a shape for none of the weights, see `facert.data.names.shape_drivers`.
    """
    known = [name for name in take.source.names if _drives(name, rig)]
    if not known:
        raise _misfit("shapes for the take's weights", f"none for {take.source.names[0]!r}")
    columns = [take.source.names.index(name) for name in known]
    weights = np.nan_to_num(take.source.values[:, columns]) @ shape_drivers(known, rig.names)
    motion = MeshSequence(rig.mesh, take.time, lambda rows: rig.deform(weights[rows]), take.fps)
    return Face("actor", motion)


def _drives(name: str, rig: Rig) -> bool:
    try:
        shape_drivers([name], rig.names)
    except InputError:
        return False
    return True


def _draw_markers(grid: Sequence[Axes], markers: FloatArray, frames: Sequence[int]) -> None:
    """Nearer ones are darker; lines come from hollow rings, where each marker mostly is."""
    markers = markers[:, ~np.isnan(markers).all(axis=(0, 2))]
    rest = np.nanmedian(markers, axis=0)
    low, high = (bound(markers, axis=(0, 1)) for bound in (np.nanmin, np.nanmax))
    middle, reach = (low + high) / 2, 0.55 * max(float((high - low)[:2].max()), 1e-9)
    for axes, frame in zip(grid, frames, strict=False):
        x, y, z = markers[frame].T
        axes.plot(*np.stack([rest, markers[frame]], axis=1).T[:2], color=INK, lw=0.6, alpha=0.6)
        axes.scatter(rest[:, 0], rest[:, 1], s=6, facecolors="none", edgecolors=INK, lw=0.4)
        axes.scatter(x, y, s=13, c=z, cmap="GnBu", vmin=low[2] - (high - low)[2], vmax=high[2])
        axes.set_xlim(middle[0] - reach, middle[0] + reach)
        axes.set_ylim(middle[1] - reach, middle[1] + reach)
        axes.set_aspect("equal")


def _draw_face(grid: Sequence[Axes], face: Face, frames: Sequence[int]) -> None:
    neutral, camera = face.motion.neutral, frame_faces([face], frames)[0]
    for axes, frame in zip(grid, frames, strict=False):
        vertices = face.motion.fetch(np.array([frame]))[0]
        axes.imshow(shade(vertices, neutral.faces, camera, PIXELS, neutral.colours))


def _misfit(expected: str, found: str) -> InputError:
    return InputError("--rig", expected, found, "Give the rig that fits, or none for markers.")
