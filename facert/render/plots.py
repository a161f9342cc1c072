"""Curves of a take's controls over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from facert.data.arrays import FloatArray
from facert.data.names import fitting_some
from facert.data.take import Take
from facert.data.text import printable
from facert.errors import InputError
from facert.render.faces import INK, require_deviations, require_poses
from facert.render.texts import with_plain_texts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CURVE, TRUTH = "#1f6f8b", "#c9a26b"
MOST = 8  # curves, if none are named
MAX_CURVES = 40
MOST_LETTERS = 32  # of a name: longer ones would leave no room for the curves


def plot_controls(take: Take, truth: Take | None = None, names: Sequence[str] = ()) -> Figure:
    """Curves of some controls, one below the other.

    The truth runs behind the take's curve; the band is twice the predictive standard deviation;
    dots mark key poses where only a part of the frames is posed.

    Parameters
    ----------
    take : Take
        With poses.
    truth : Take, optional
        A take of the same performance with the controls that are drawn.
    names : sequence of str
        The controls to draw, or patterns such as ``"mouth*"``; the most varying ones if empty.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        When the take has no poses, one of the takes lacks a control, or `names` are too many.
    """
    from matplotlib.figure import Figure

    columns = _columns(take, names) or most_varying(take, MOST)
    figure = Figure(figsize=(10, 1.05 * len(columns) + 0.7), dpi=150, layout="constrained")
    grid = figure.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
    assert take.controls is not None  # poses come with controls
    for axes, column in zip(grid, columns, strict=True):
        name = take.controls.names[column]
        if truth is not None:
            values = require_poses(truth)[:, _columns(truth, [name])[0]]
            axes.plot(truth.time, values, color=TRUTH, linewidth=2.4, label="truth")
        _draw_curve(axes, take, column)
        _tidy(axes, name)
    grid[-1].set_xlabel("seconds", color=INK)
    _number_frames(grid[0], take)
    if truth is not None or take.std is not None:
        shown = grid[0].get_legend_handles_labels()
        figure.legend(*shown, loc="outside upper right", ncols=3, frameon=False, fontsize=8)
    return with_plain_texts(figure)


def _number_frames(axes: Axes, take: Take) -> None:
    """Numbers of the frames, as options count them, above the curves."""
    from matplotlib.ticker import MaxNLocator

    frames = np.arange(len(take))
    step = 1 / take.fps
    # One more frame at either end, so that the margins have numbers too.
    seconds = np.concatenate([[take.time[0] - step], take.time, [take.time[-1] + step]])
    around = np.concatenate([[-1], frames, [len(take)]])

    def to_frames(at: ArrayLike) -> FloatArray:
        within = np.clip(at, seconds[0], seconds[-1])
        return np.asarray(np.interp(within, seconds, around) + (at - within) * take.fps)

    def to_seconds(at: ArrayLike) -> FloatArray:
        within = np.clip(at, around[0], around[-1])
        return np.asarray(np.interp(within, around, seconds) + (at - within) / take.fps)

    top = axes.secondary_xaxis("top", functions=(to_frames, to_seconds))
    top.xaxis.set_major_locator(MaxNLocator(10, integer=True, steps=[1, 2, 5, 10]))
    top.set_xlabel("frame", color=INK, fontsize=8)
    top.tick_params(colors=INK, labelsize=8)
    top.spines["top"].set_visible(False)


def _draw_curve(axes: Axes, take: Take, column: int) -> None:
    values = require_poses(take)[:, column]
    std = require_deviations(take)
    if std is not None:
        band = 2 * std[:, column]
        axes.fill_between(
            take.time, values - band, values + band, color=CURVE, alpha=0.2, lw=0, label="± 2 std"
        )
    if len(take.labels) == len(take):
        axes.plot(take.time, values, color=CURVE, linewidth=1.1, label="character")
    else:
        keys = take.labels
        axes.plot(take.time[keys], values[keys], "o", color=CURVE, markersize=4, label="key poses")


def _tidy(axes: Axes, name: str) -> None:
    axes.set_ylabel(printable(name, MOST_LETTERS), rotation=0, ha="right", va="center", color=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.005)
    axes.tick_params(colors=INK, labelsize=8)


def most_varying(take: Take, count: int) -> list[int]:
    """Indices of the controls that vary most over the posed frames, rising."""
    spread = require_poses(take)[take.labels].std(axis=0)
    return sorted(np.argsort(-spread, kind="stable")[:count].tolist())


def _columns(take: Take, names: Sequence[str]) -> list[int]:
    """Indices of the controls that fit names or patterns, each once."""
    require_poses(take)
    assert take.controls is not None  # poses come with controls
    there = take.controls.names
    found = [place for name in names for place in fitting_some(name, there, "--controls")]
    if len(found) > MAX_CURVES:
        fix = "Draw several pictures."
        raise InputError("--controls", f"at most {MAX_CURVES} names", f"{len(found)}", fix)
    return list(dict.fromkeys(found))
