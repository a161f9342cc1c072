"""Pictures of a performance: the markers, and the character's face beside the truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from facert.data import FloatArray, Rig, Take
from facert.errors import InputError
from facert.names import NameIndex, nearest
from facert.view.shade import frame_mesh, shade

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CELL = 2.2  # inches a picture
RESOLUTION = 150  # pixels an inch
TURN = -0.22  # radians; seen a little from the side, a face has more shape
INK = "#3a3f47"
MAX_FRAMES = 40


def render_faces(take: Take, rig: Rig, frames: Sequence[int], truth: Take | None = None) -> Figure:
    """Frames of a take side by side.

    Parameters
    ----------
    take : Take
        With poses; its markers, if it has any, make the first row.
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
    from matplotlib.figure import Figure

    frames = _checked_frames(frames, take)
    rows: dict[str, FloatArray] = {"character": control_settings(take, rig, frames)}
    if truth is not None:
        _require_same_length(take, truth)
        rows["truth"] = control_settings(truth, rig, frames)
    with_markers = take.source.kind == "markers"
    height, width = len(rows) + with_markers, len(frames)
    figure = Figure(figsize=(CELL * width + 0.4, CELL * height + 0.3), dpi=RESOLUTION)
    grid = figure.subplots(height, width, squeeze=False, gridspec_kw=_margins(figure))
    for axes, frame in zip(grid[0], frames, strict=True):
        axes.set_title(f"{take.time[frame]:.2f} s", fontsize=9, color=INK)
    if with_markers:
        _draw_markers(grid[0], take, frames)
    for line, (name, settings) in zip(grid[int(with_markers) :], rows.items(), strict=True):
        _draw_faces(line, rig, settings)
        _label(line[0], name)
    for axes in grid.flat:
        axes.set_axis_off()
    return figure


def choose_frames(poses: FloatArray, count: int) -> list[int]:
    """Frames whose poses (T, P) are far from each other, in order of time; NaN rows are left out.

    The first is the pose nearest to rest, each next one the farthest from all before.
    """
    known = np.flatnonzero(~np.isnan(poses).any(axis=1))
    if not len(known):
        raise InputError(
            "/target/params", "a pose in at least one frame", "none", "Retarget the take first."
        )
    poses = poses[known] / np.maximum(np.ptp(poses[known], axis=0), 1e-9)
    distance = np.linalg.norm(poses - np.median(poses, axis=0), axis=1)
    chosen = [int(distance.argmin())]
    distance = np.full(len(poses), np.inf)
    for _ in range(min(count, len(known)) - 1):
        distance = np.minimum(distance, np.linalg.norm(poses - poses[chosen[-1]], axis=1))
        chosen.append(int(distance.argmax()))
    return sorted(int(frame) for frame in known[np.unique(chosen)])


def control_settings(take: Take, rig: Rig, frames: Sequence[int]) -> FloatArray:
    """The take's poses in some frames as the rig's parameters (n, P); other shapes stay at 0.

    Names are matched in any spelling; a control without a side drives both halves of its shape.

    Raises
    ------
    InputError
        When the take has no poses, or a control that the rig has no shape for.
    """
    poses, controls = require_poses(take), take.controls
    assert controls is not None  # poses come with controls
    index = NameIndex(rig.names)
    shapes = [_shapes_of(name, index) for name in controls.names]
    unknown = [name for name, found in zip(controls.names, shapes, strict=True) if not found]
    if unknown:
        near = nearest(unknown[0], rig.names)
        hint = f" (did you mean {near!r}?)" if near else ""
        raise InputError(
            "/target/names",
            "controls that the rig has a shape for",
            f"{unknown[0]!r}{hint}, {len(unknown)} unknown in all",
            "Give the rig of this take's character.",
        )
    settings = np.zeros((len(frames), len(rig.names)))
    for column, found in enumerate(shapes):
        settings[:, found] = poses[np.asarray(frames), column, None]
    return settings


def _shapes_of(control: str, index: NameIndex) -> list[int]:
    """The shape of a control in any spelling, or its left and right halves."""
    whole = index.find(control)
    if whole is not None:
        return [whole]
    halves = (index.find(f"{control}_{side}") for side in "LR")
    return [half for half in halves if half is not None]


def require_poses(take: Take) -> FloatArray:
    """The take's poses (T, P).

    Raises
    ------
    InputError
        When it has none.
    """
    if take.params is None or not len(take.labels):
        raise InputError(
            "/target/params", "poses of the character", "none", "Give a take that was retargeted."
        )
    return take.params


def _checked_frames(frames: Sequence[int], take: Take) -> list[int]:
    if len(frames) > MAX_FRAMES:
        raise InputError(
            "--frames", f"at most {MAX_FRAMES} frames", f"{len(frames)}", "Draw several pictures."
        )
    outside = [frame for frame in frames if not 0 <= frame < len(take)]
    if outside or not frames:
        raise InputError(
            "--frames",
            f"frames from 0 to {len(take) - 1}",
            str(outside[0]) if outside else "none",
            "Choose others.",
        )
    return list(frames)


def _require_same_length(take: Take, truth: Take) -> None:
    if len(take) != len(truth):
        raise InputError(
            "--truth", f"{len(take)} frames", f"{len(truth)}", "Give the truth of the same take."
        )


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


def _draw_faces(line: Sequence[Axes], rig: Rig, settings: FloatArray) -> None:
    camera = frame_mesh(rig.neutral, TURN)
    size = round(CELL * RESOLUTION)
    for axes, setting in zip(line, settings, strict=True):
        if np.isnan(setting).any():
            axes.text(0.5, 0.5, "no pose", ha="center", color=INK, transform=axes.transAxes)
            continue
        vertices = rig.deform(setting[None])[0]
        axes.imshow(shade(vertices, rig.faces, camera, size, rig.colours))


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
