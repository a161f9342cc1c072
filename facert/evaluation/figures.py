"""The paper's figures: RMS against the number of labels (4) and of unlabelled frames (5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Literal

import numpy as np

from facert.data.text import printable
from facert.evaluation.table import EvaluationRow
from facert.render.texts import with_plain_texts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#3a3f47"
# Okabe and Ito's colours, which everybody can distinguish, and three more; markers help in print.
COLOURS = (
    *("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a6f00", "#000000"),
    *("#8c564b", "#8a8a8a", "#7048c0"),
)
MARKERS = "osD^vP*Xhd"
LETTERS = 32  # of a name: longer ones would leave no room for the curves
ASIDE = 0.025  # of the extent

Axis = Literal["labels", "unlabelled"]
NAMES: dict[Axis, str] = {
    "labels": "labelled frames",
    "unlabelled": "unlabelled frames, and as many poses",
}


@dataclass(frozen=True)
class Panel:
    """One diagram: rows that differ in method and in one number."""

    axis: Axis
    title: str
    rows: Sequence[EvaluationRow]


def plot_errors(rows: Sequence[EvaluationRow], title: str = "") -> Figure:
    """RMS of each method, with standard errors, against what varies in the rows.

    Parameters
    ----------
    rows : sequence of EvaluationRow
        From `facert.evaluation.table.summarise`, one with an RMS at least. When labels and
        unlabelled data both vary, there is a panel for each: labels with the most unlabelled
        data, and unlabelled data with the fewest labels.
    title : str
        Above all.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    parts = panels(rows)
    figure = Figure(figsize=(5.2 * len(parts) + 1.6, 4.2), dpi=150, layout="constrained")
    grid = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    methods = sorted({row.method for row in rows})
    for axes, part in zip(grid, parts, strict=True):
        for index, method in enumerate(methods):
            _draw_curve(axes, part, method, index, index / len(methods) - 0.5)
        _tidy(axes, part)
    grid[0].set_ylabel("RMS over controls", color=INK)
    _legend(figure, grid[0], parts[0])
    figure.suptitle(title, color=INK, fontsize=11)
    return with_plain_texts(figure)


def panels(rows: Sequence[EvaluationRow]) -> list[Panel]:
    """Panels to draw: one for each number that varies, or one for labels."""
    rows = [row for row in rows if row.rms is not None]
    labels, unlabelled = {row.labels for row in rows}, {row.unlabelled for row in rows}
    parts = []
    if len(labels) > 1 or len(unlabelled) == 1:
        most = max(unlabelled)
        chosen = [row for row in rows if row.unlabelled == most]
        parts.append(Panel("labels", f"{most} unlabelled frames and poses", chosen))
    if len(unlabelled) > 1:
        fewest = min(labels)
        chosen = [row for row in rows if row.labels == fewest]
        parts.append(Panel("unlabelled", f"{fewest} labelled frames", chosen))
    return parts


def _draw_curve(axes: Axes, part: Panel, method: str, index: int, aside: float) -> None:
    """The curve of a method, moved aside a little (-1/2 to 1/2) to keep the bars apart."""
    get = attrgetter(part.axis)
    points = sorted((row for row in part.rows if row.method == method), key=get)
    extent = max(map(get, part.rows)) - min(map(get, part.rows))
    axes.errorbar(
        [get(row) + ASIDE * extent * aside for row in points],
        [np.nan if row.rms is None else row.rms for row in points],
        yerr=[row.rms_se or 0.0 for row in points],
        color=COLOURS[index % len(COLOURS)],
        marker=MARKERS[index % len(MARKERS)],
        markersize=4.5,
        linewidth=1.3,
        elinewidth=0.8,
        capsize=2,
        label=printable(method, LETTERS),
    )


def _tidy(axes: Axes, part: Panel) -> None:
    axes.set_title(part.title, fontsize=9, color=INK)
    axes.set_xlabel(NAMES[part.axis], color=INK)
    axes.set_xticks(sorted({getattr(row, part.axis) for row in part.rows}))
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8)


def _legend(figure: Figure, axes: Axes, part: Panel) -> None:
    """Methods in the order of the curves' right ends, highest first."""
    last = max(getattr(row, part.axis) for row in part.rows)
    rows = [row for row in part.rows if getattr(row, part.axis) == last]
    ends = {printable(row.method, LETTERS): row.rms or 0.0 for row in rows}
    handles, names = axes.get_legend_handles_labels()
    order = sorted(range(len(names)), key=lambda i: -ends.get(names[i], 0.0))
    figure.legend(
        [handles[i] for i in order],
        [names[i] for i in order],
        loc="outside right center",
        frameon=False,
        fontsize=8,
    )
