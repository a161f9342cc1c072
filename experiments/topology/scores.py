"""Errors of several methods on the same tests: means, standard errors, ratios, diagrams."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from experiments.report import markdown
from facert.data.arrays import FloatArray
from facert.evaluation.figures import COLOURS, INK

BLACK = "#000000"


@dataclass(frozen=True)
class Scores:
    """The error of each method in each test.

    Parameters
    ----------
    errors : mapping from str to array, shape (N,)
        The same tests in the same order for every method.
    default : str
        What facert ships.
    own : sequence of str
        The paper's methods and their extensions; all others are baselines.
    """

    errors: Mapping[str, FloatArray]
    default: str
    own: Sequence[str]

    @property
    def best_baseline(self) -> str:
        """The baseline whose mean error is least."""
        baselines = [name for name in self.errors if name not in self.own]
        return min(baselines, key=lambda name: float(self.errors[name].mean()))

    def table(self, quantity: str) -> str:
        """Mean, standard error, and the ratio of the means to the best baseline, best first."""
        reference = self.errors[self.best_baseline].mean()
        rows = []
        for name, errors in sorted(self.errors.items(), key=lambda item: item[1].mean()):
            shown = f"**{name}**" if name == self.default else name
            error = errors.std(ddof=1) / np.sqrt(len(errors))
            rows.append(
                (shown, f"{errors.mean():.4f}", f"{error:.4f}", f"{errors.mean() / reference:.2f}")
            )
        return markdown(("method", quantity, "standard error", f"to {self.best_baseline}"), rows)

    def rows(self, **where: object) -> list[dict[str, object]]:
        """A row a test, with a column for every method."""
        count = len(next(iter(self.errors.values())))
        return [
            {**where, "test": test, **{name: float(one[test]) for name, one in self.errors.items()}}
            for test in range(count)
        ]


def draw_curves(
    axes: Axes, x: Sequence[float], curves: Mapping[str, FloatArray], methods: Sequence[str]
) -> None:
    """One curve a method over the same places; the first of all methods is black and broad."""
    colours = dict(zip(methods, [colour for colour in COLOURS if colour != BLACK], strict=False))
    for name, values in curves.items():
        if name == methods[0]:
            axes.plot(x, values, color=BLACK, linewidth=2.4, label=name, zorder=5)
        else:
            axes.plot(x, values, color=colours[name], linewidth=1.1, label=name)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)
    axes.tick_params(colors=INK, labelsize=8)
