"""A sheet of pictures: frames from left to right, the markers and each face in a row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from facert.data.rig import Rig
from facert.data.take import Take
from facert.errors import InputError
from facert.render.faces import Face, frame_faces, posed_face, require_same_length
from facert.render.shade import Camera, shade

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CELL = 2.2  # inches a picture
PIXELS = 320
INK = "#3a3f47"
MAX_FRAMES = 40


def render_faces(take: Take, rig: Rig, frames: Sequence[int], truth: Take | None = None) -> Figure:
    """Frames of a take side by side: its markers if it has any, the character, the truth.

    Parameters
    ----------
    take : Take
        With poses.
    rig : Rig
        The character; shapes and controls are matched by name.
    frames : sequence of int
    truth : Take, optional
        A take with the same frames, whose poses make the last row.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        When names, frames or lengths do not fit together.
    """
    faces = [posed_face(take, rig, "character")]
    if truth is not None:
        faces.append(posed_face(truth, rig, "truth"))
    return render_sheet(faces, frames, take)


def render_sheet(
    faces: Sequence[Face], frames: Sequence[int], take: Take | None = None, pixels: int = PIXELS
) -> Figure:
    """A row of pictures for each face.

    Parameters
    ----------
    faces : sequence of Face
        With the same number of frames.
    frames : sequence of int
    take : Take, optional
        Its markers, if it has any, make the first row.
    pixels : int
        Width and height of a picture.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        When frames or lengths do not fit together.
    """
    from matplotlib.figure import Figure

    require_same_length(faces)
    frames = checked_frames(frames, len(faces[0].motion))
    with_markers = take is not None and take.source.kind == "markers"
    height, width = len(faces) + with_markers, len(frames)
    figure = Figure(figsize=(CELL * width + 0.4, CELL * height + 0.3), dpi=pixels / CELL)
    grid = figure.subplots(height, width, squeeze=False, gridspec_kw=_margins(figure))
    for axes, time in zip(grid[0], faces[0].motion.time[frames], strict=True):
        axes.set_title(f"{time:.2f} s", fontsize=9, color=INK)
    if take is not None and with_markers:
        _draw_markers(grid[0], take, frames)
    cameras = frame_faces(faces, frames)
    for line, face, camera in zip(grid[int(with_markers) :], faces, cameras, strict=True):
        _draw_face(line, face, camera, frames, pixels)
        _label(line[0], face.label)
    for axes in grid.flat:
        axes.set_axis_off()
    return figure


def checked_frames(frames: Sequence[int], length: int) -> list[int]:
    """The frames of a sheet, if they exist and are not too many.

    Raises
    ------
    InputError
        When they do not.
    """
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


def _draw_markers(line: Sequence[Axes], take: Take, frames: Sequence[int]) -> None:
    """Markers from the front; nearer ones are darker."""
    markers = take.source.values
    low, high = (bound(markers, axis=(0, 1)) for bound in (np.nanmin, np.nanmax))
    middle, reach = (low + high) / 2, 0.58 * max(float((high - low)[:2].max()), 1e-9)
    for axes, frame in zip(line, frames, strict=True):
        x, y, z = markers[frame].T
        axes.scatter(x, y, s=13, c=z, cmap="GnBu", vmin=low[2] - (high - low)[2], vmax=high[2])
        axes.set_xlim(middle[0] - reach, middle[0] + reach)
        axes.set_ylim(middle[1] - reach, middle[1] + reach)
        axes.set_aspect("equal")
    _label(line[0], "markers")


def _draw_face(
    line: Sequence[Axes], face: Face, camera: Camera, frames: Sequence[int], pixels: int
) -> None:
    neutral = face.motion.neutral
    for axes, frame in zip(line, frames, strict=True):
        vertices = face.motion.fetch(np.array([frame]))[0]
        if np.isnan(vertices).any():
            axes.text(0.5, 0.5, "no pose", ha="center", color=INK, transform=axes.transAxes)
            continue
        axes.imshow(shade(vertices, neutral.faces, camera, pixels, neutral.colours))


def _label(axes: Axes, text: str) -> None:
    axes.text(
        -0.04,
        0.5,
        text,
        rotation=90,
        ha="right",
        va="center",
        fontsize=10,
        color=INK,
        transform=axes.transAxes,
    )


def _margins(figure: Figure) -> dict[str, float]:
    """Little space between the pictures, room for labels at the left and times on top."""
    width, height = figure.get_size_inches()
    return {
        "left": 0.38 / width,
        "right": 1 - 0.02 / width,
        "bottom": 0.02 / height,
        "top": 1 - 0.28 / height,
        "wspace": 0.02,
        "hspace": 0.02,
    }
