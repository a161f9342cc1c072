"""Sheets of pictures: rows of faces, contact sheets of an actor, and feature points on a face."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from facert.data.arrays import FloatArray, IntArray, require_bounded
from facert.data.moments import frame_label
from facert.data.rig import Mesh, Rig
from facert.data.take import Take
from facert.errors import InputError
from facert.render.faces import (
    INK,
    Face,
    FrameAt,
    actor_face,
    frame_faces,
    require_drawable,
    require_same_length,
)
from facert.render.shade import Camera, frame_mesh, shade
from facert.render.texts import with_plain_texts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CELL, HEADING = 2.2, 0.3  # inches of a picture, and above one of a contact sheet
LEGEND = 0.28  # inches below a contact sheet
MARKERS = "dots: markers, darker where nearer; rings: where each mostly is, lines: how it moved"
WEIGHTS = "the actor's face in the tracked weights"
PIXELS = 320
MAX_FRAMES = 40
ACROSS = 5  # least pictures in a row of a contact sheet, if there are so many
WIDE = 1.6  # width of a large contact sheet over its height
TURNS = (0.0, -0.9)  # radians, of a face with points: from the front, and from the side
_BARE: dict[str, Any] = {"xticks": [], "yticks": []}
"""Of axes that are not shown: their ticks would take longer than a small face."""
_POINT = "#b3261e"
_POINTS_INCHES, _POINTS_RESOLUTION = 4.5, 150


def render_sheet(
    faces: Sequence[Face],
    frames: Sequence[int],
    take: Take | None = None,
    pixels: int = PIXELS,
    video: FrameAt | None = None,
) -> Figure:
    """A row of pictures for each face, below the numbers of the frames.

    Parameters
    ----------
    faces : sequence of Face
        With the same number of frames.
    frames : sequence of int
    take : Take, optional
        Its markers, if it has any, make the first row.
    pixels : int
        Width and height of a picture.
    video : callable, optional
        The performer's, which makes the first row.

    Raises
    ------
    InputError
        When frames or lengths do not fit together.
    """
    from matplotlib.figure import Figure

    require_same_length(faces)
    frames = checked_frames(frames, len(faces[0].motion))
    with_markers = take is not None and take.source.kind == "markers"
    height, width = len(faces) + with_markers + (video is not None), len(frames)
    figure = Figure(figsize=(CELL * width + 0.4, CELL * height + 0.3), dpi=pixels / CELL)
    grid = figure.subplots(height, width, squeeze=False, subplot_kw=_BARE)
    # Little space between the pictures, room for labels at the left and times on top.
    wide, high = figure.get_size_inches()
    figure.subplots_adjust(0.38 / wide, 0.02 / high, 1 - 0.02 / wide, 1 - 0.28 / high, 0.02, 0.02)
    motion, lines = faces[0].motion, iter(grid)
    for axes, frame in zip(grid[0], frames, strict=True):
        axes.set_title(frame_label(motion, frame), fontsize=9, color=INK)
    if video is not None:
        _draw_video(line := next(lines), video, motion.time[frames])
        _label(line[0], "video")
    if take is not None and with_markers:
        _draw_markers(line := next(lines), take.source.values, frames, 0.58)
        _label(line[0], "markers")
    for line, face, camera in zip(lines, faces, frame_faces(faces, frames), strict=True):
        _draw_face(line, face, camera, frames, pixels)
        _label(line[0], face.label)
    for axes in grid.flat:
        axes.set_axis_off()
    return with_plain_texts(figure)


def contact_sheet(
    take: Take,
    frames: Sequence[int],
    headings: Sequence[str],
    actor: Rig | Face | None = None,
    video: FrameAt | None = None,
) -> Figure:
    """The actor in some frames, from the front: as markers, or as the face that weights drive.

    Below stands what is drawn.

    Parameters
    ----------
    take : Take
    frames : sequence of int
    headings : sequence of str
        One a frame.
    actor : Rig or Face, optional
        For a take of weights: a rig with a shape, or its left and right half, for each that the
        take and the rig have in common; or the face that they drive.
    video : callable, optional
        The performer's, above each picture, or alone for weights without a face.

    Raises
    ------
    InputError
        When there are too many frames, or a take of weights comes without face and video, or
        markers with a rig.
    """
    from matplotlib.figure import Figure

    frames = checked_frames(frames, len(take))
    layers = _contact_layers(take, frames, actor, video)
    width = min(len(frames), max(ACROSS, math.ceil(math.sqrt(WIDE * len(frames) / len(layers)))))
    height = len(layers) * -(-len(frames) // width)
    inches = (CELL + HEADING) * height + LEGEND
    figure = Figure((CELL * width, inches), dpi=PIXELS / CELL)
    grid = figure.subplots(height, width, squeeze=False, subplot_kw=_BARE)
    top = 1 - 0.75 * HEADING / inches
    figure.subplots_adjust(0, LEGEND / inches, 1, top, wspace=0.02, hspace=HEADING / CELL)
    for axes in grid.flat:
        axes.set_axis_off()
    for place, (_, draw) in enumerate(layers):
        draw(list(grid[place :: len(layers)].flat))
    for axes, heading in zip(grid[:: len(layers)].flat, headings, strict=False):
        axes.set_title(heading, fontsize=9, color=INK, pad=3)
    style = {"fontsize": 7, "color": INK, "va": "bottom", "wrap": True}
    figure.text(0.06 / (CELL * width), 0.05 / inches, "; ".join(text for text, _ in layers), style)
    return with_plain_texts(figure)


def _contact_layers(
    take: Take, frames: list[int], actor: Rig | Face | None, video: FrameAt | None
) -> list[tuple[str, Callable[[Sequence[Axes]], None]]]:
    """What is drawn of each frame, one above the other, with its line of the legend."""
    layers: list[tuple[str, Callable[[Sequence[Axes]], None]]] = []
    if video is not None:
        moments = take.time[frames]
        layers.append(("the performer's video", lambda cells: _draw_video(cells, video, moments)))
    if actor is None and video is not None and take.source.kind == "weights":
        return layers
    require_drawable(take, actor)
    if actor is None:
        values = take.source.values
        layers.append((MARKERS, lambda cells: _draw_markers(cells, values, frames, 0.55, True)))
        return layers
    face = actor_face(take, actor) if isinstance(actor, Rig) else actor
    camera = frame_faces([face], frames)[0]
    layers.append((WEIGHTS, lambda cells: _draw_face(cells, face, camera, frames, PIXELS)))
    return layers


def draw_points(mesh: Mesh, vertices: IntArray) -> Figure:
    """A face from the front and from the side, with the place of each point among them.

    Parameters
    ----------
    mesh : Mesh
    vertices : array of int, shape (M,)
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_POINTS_INCHES * len(TURNS), _POINTS_INCHES), dpi=_POINTS_RESOLUTION)
    size = round(_POINTS_INCHES * _POINTS_RESOLUTION)
    grid = figure.subplots(1, len(TURNS), subplot_kw=_BARE)
    figure.subplots_adjust(0, 0, 1, 1, wspace=0)
    for axes, turn in zip(grid, TURNS, strict=True):
        camera = frame_mesh(mesh.vertices, turn)
        axes.imshow(shade(mesh.vertices, mesh.faces, camera, size, mesh.colours))
        column, row, depth = camera.project(mesh.vertices, size)[vertices].T
        for place in np.argsort(depth):  # nearer ones over farther ones
            axes.plot(column[place], row[place], "o", ms=4, color=_POINT, mec="white", mew=0.5)
            axes.annotate(
                str(place + 1),
                (column[place], row[place]),
                (3, 2),
                "data",
                "offset points",
                fontsize=5,
                color=_POINT,
            )
        axes.set_axis_off()
    return with_plain_texts(figure)


def checked_frames(frames: Sequence[int], length: int) -> list[int]:
    """The frames of a sheet; raises InputError when some do not exist, or they are too many."""
    if len(frames) > MAX_FRAMES:
        raise InputError(
            "--frames", f"at most {MAX_FRAMES} frames", f"{len(frames)}", "Draw several pictures."
        )
    outside = [frame for frame in frames if not 0 <= frame < length]
    if outside or not frames:
        raise InputError(
            "--frames",
            f"frames from 0 to {length - 1}",
            str(outside[0]) if outside else "none",
            "Choose others.",
        )
    return list(frames)


def _draw_markers(
    cells: Sequence[Axes],
    markers: FloatArray,
    frames: Sequence[int],
    room: float,
    rings: bool = False,
) -> None:
    """Markers (T, M, 3) from the front; nearer ones are darker.

    `room` is half the height shown, in their largest extent. With `rings`, lines come from hollow
    rings where each marker mostly is.
    """
    require_bounded(markers, "/source/markers")
    markers = markers[:, ~np.isnan(markers).all(axis=(0, 2))]
    rest = np.nanmedian(markers, axis=0) if rings else markers[0]
    low, high = (bound(markers, axis=(0, 1)) for bound in (np.nanmin, np.nanmax))
    middle, reach = (low + high) / 2, room * max(float((high - low)[:2].max()), 1e-9)
    for axes, frame in zip(cells, frames, strict=False):
        if rings:
            lines = np.stack([rest, markers[frame]], axis=1).T[:2]
            axes.plot(*lines, color=INK, lw=0.6, alpha=0.6)
            axes.scatter(rest[:, 0], rest[:, 1], s=6, facecolors="none", edgecolors=INK, lw=0.4)
        x, y, z = markers[frame].T
        axes.scatter(x, y, s=13, c=z, cmap="GnBu", vmin=low[2] - (high - low)[2], vmax=high[2])
        axes.set_xlim(middle[0] - reach, middle[0] + reach)
        axes.set_ylim(middle[1] - reach, middle[1] + reach)
        axes.set_aspect("equal")


def _draw_face(
    cells: Sequence[Axes], face: Face, camera: Camera, frames: Sequence[int], pixels: int
) -> None:
    for axes, frame in zip(cells, frames, strict=False):
        picture = face.picture(face.motion.fetch(np.array([frame]))[0], camera, pixels)
        if picture is None:
            _write(axes, face.blank)
        else:
            axes.imshow(picture)


def _draw_video(cells: Sequence[Axes], video: FrameAt, moments: FloatArray) -> None:
    for axes, seconds in zip(cells, moments, strict=False):
        picture = video(float(seconds))
        if picture is None:
            _write(axes, "no video")
        else:
            axes.imshow(picture)


def _write(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, ha="center", color=INK, transform=axes.transAxes)


def _label(axes: Axes, text: str) -> None:
    style = {"rotation": 90, "ha": "right", "va": "center", "fontsize": 10, "color": INK}
    axes.text(-0.04, 0.5, text, style, transform=axes.transAxes)
