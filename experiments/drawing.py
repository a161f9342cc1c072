"""Small multiples: a panel for each problem, a curve for each method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from operator import attrgetter
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from experiments.grid import DEFAULT
from facert.evaluation.figures import COLOURS, INK, NAMES, Axis
from facert.evaluation.table import EvaluationRow
from facert.io.atomic import replacing
from facert.methods.registry import REGISTRY

COLUMNS = 3  # a line for each target: of three tracks, three, and two with the legend beside
INKS = 128  # colours of a picture, enough for smooth lines
MARKERS = "s^vDP*Xhd<>"


@dataclass(frozen=True)
class Panel:
    """The curves of one problem.

    Parameters
    ----------
    title : str
    rows : sequence of EvaluationRow
        They differ in method and in the number on the x axis.
    references : sequence of EvaluationRow
        Methods for which that number means nothing: a horizontal line each.
    """

    title: str
    rows: Sequence[EvaluationRow]
    references: Sequence[EvaluationRow] = ()


def draw_panels(panels: Sequence[Panel], axis: Axis, title: str) -> Figure:
    """RMS with standard errors against labels or unlabelled data, each panel on its own scale."""
    columns = min(COLUMNS, len(panels))
    lines = -(-len(panels) // columns)
    figure = Figure(figsize=(3.4 * columns, 2.6 * lines + 0.4), dpi=120, layout="constrained")
    grid = figure.subplots(lines, columns, squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=False):
        _draw(axes, panel, axis)
    for axes in grid[:, 0]:
        axes.set_ylabel("RMS over controls", color=INK, fontsize=9)
    for axes in grid.flat[max(len(panels) - columns, 0) : len(panels)]:
        axes.set_xlabel(NAMES[axis], color=INK, fontsize=9)
    figure.suptitle(title, color=INK, fontsize=11)
    spare = list(grid.flat[len(panels) :])
    for axes in spare:
        axes.set_axis_off()
    _legend(grid.flat[0], spare[0] if spare else figure)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a PNG that is small enough for a repository."""
    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    picture = Image.open(drawn).convert("RGB").quantize(INKS)
    with replacing(path, overwrite=True) as temporary:
        picture.save(temporary, optimize=True)


@dataclass(frozen=True)
class Style:
    """How the curve of a method is drawn, in every figure alike."""

    colour: str
    marker: str
    width: float = 1.1
    size: float = 3.5
    layer: int = 3


def _style(method: str) -> Style:
    """The default in front, black and broad; the others by their places in the registry."""
    if method == DEFAULT:
        return Style("black", "o", width=2.6, size=6, layer=5)
    place = [name for name in REGISTRY if name != DEFAULT].index(method)
    colours = [colour for colour in COLOURS if colour != "#000000"]
    return Style(colours[place % len(colours)], MARKERS[place % len(MARKERS)])


def _draw(axes: Axes, panel: Panel, axis: Axis) -> None:
    get = attrgetter(axis)
    for method in {row.method for row in panel.rows}:
        points = sorted((row for row in panel.rows if row.method == method), key=get)
        style = _style(method)
        axes.errorbar(
            [get(row) for row in points],
            [rms_of(row) for row in points],
            yerr=[row.rms_se or 0.0 for row in points],
            label=method,
            color=style.colour,
            linewidth=style.width,
            elinewidth=0.7,
            marker=style.marker,
            markersize=style.size,
            zorder=style.layer,
        )
    for row in panel.references:
        axes.axhline(
            rms_of(row),
            label=row.method,
            color=_style(row.method).colour,
            linewidth=1.0,
            linestyle=(0, (4, 2)),
        )
    axes.set_title(panel.title, fontsize=9, color=INK)
    axes.set_xticks(sorted({get(row) for row in panel.rows}))
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8)


def rms_of(row: EvaluationRow) -> float:
    """Of a method that could run."""
    assert row.rms is not None  # others are not drawn
    return row.rms


def _legend(axes: Axes, place: Axes | Figure) -> None:
    """The default first, the others as in the registry; in a spare panel if there is one."""
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    names = sorted(handles, key=lambda name: (name != DEFAULT, list(REGISTRY).index(name)))
    place.legend(
        [handles[name] for name in names],
        names,
        loc="center" if isinstance(place, Axes) else "outside right center",
        ncols=2 if isinstance(place, Axes) else 1,
        frameon=False,
        fontsize=9,
    )
