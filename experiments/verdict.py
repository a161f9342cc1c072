"""The default against the other methods, over cells of an evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.grid import DEFAULT, Case
from facert.data.arrays import FloatArray
from facert.evaluation.paired import MeanWithError, paired_ratio


@dataclass(frozen=True)
class Cell:
    """The RMS of each method that ran every draw of a problem at a number of labels, (repeats,)."""

    case: Case
    labels: int
    errors: Mapping[str, FloatArray]

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.case.name}, {self.labels} labels"

    @property
    def others(self) -> list[str]:
        """The methods besides the default, the best first."""
        names = [method for method in self.errors if method != DEFAULT]
        return sorted(names, key=lambda method: float(self.errors[method].mean()))

    def ratio(self, other: str) -> MeanWithError:
        """The default's mean RMS over that of another method."""
        return paired_ratio(self.errors[DEFAULT], self.errors[other])

    def difference(self, other: str) -> MeanWithError:
        """The default's mean RMS less that of another method."""
        return MeanWithError.of(self.errors[DEFAULT] - self.errors[other])


@dataclass(frozen=True)
class Verdict:
    """The default against the others over some cells.

    Parameters
    ----------
    single : str
        The other method against which the mean over the cells of the ratio is highest.
    against_single : float
        That mean.
    mean, worst : float
        Over the cells, of the ratio to the best other method of each.
    worst_beyond : float
        The highest of that ratio less its standard error.
    where : str
        The cell of `worst_beyond`.
    beaten : int
        Cells in which the best other is ahead by more than the standard error of the difference.
    """

    cells: int
    single: str
    against_single: float
    mean: float
    worst: float
    worst_beyond: float
    where: str
    beaten: int


def judge(cells: Sequence[Cell]) -> Verdict:
    """Sum up cells."""
    single = max(common_others(cells), key=lambda method: mean_ratio(cells, method))
    ratios = [cell.ratio(cell.others[0]) for cell in cells]
    differences = [cell.difference(cell.others[0]) for cell in cells]
    beyond = [ratio.value - ratio.se for ratio in ratios]
    return Verdict(
        cells=len(cells),
        single=single,
        against_single=mean_ratio(cells, single),
        mean=float(np.mean([ratio.value for ratio in ratios])),
        worst=max(ratio.value for ratio in ratios),
        worst_beyond=max(beyond),
        where=cells[int(np.argmax(beyond))].name,
        beaten=sum(difference.value > difference.se for difference in differences),
    )


def common_others(cells: Sequence[Cell]) -> list[str]:
    """Methods besides the default that ran in every cell."""
    return [name for name in cells[0].others if all(name in cell.errors for cell in cells)]


def mean_ratio(cells: Sequence[Cell], method: str) -> float:
    """Over the cells, of the default's RMS to that of another method."""
    return float(np.mean([cell.ratio(method).value for cell in cells]))


def lead(cells: Sequence[Cell], method: str) -> MeanWithError:
    """Mean over cells and draws of log(default / method); the error is that between the draws."""
    logs = [np.log(cell.errors[DEFAULT] / cell.errors[method]) for cell in cells]
    return MeanWithError.of(np.mean(logs, axis=0))
