"""Methods compared on the same draws: what all draws share falls out of the standard error."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray
from facert.evaluation.cells import Outcome

LEAST = 1e-12  # an RMS below this is as good as none; one can still divide by it


@dataclass(frozen=True)
class MeanWithError:
    """A mean over draws and its standard error, NaN with a single draw."""

    value: float
    se: float

    @classmethod
    def of(cls, values: FloatArray) -> MeanWithError:
        """The mean of values (n,), one a draw."""
        return cls(float(values.mean()), _standard_error(values))


def paired_ratio(errors: FloatArray, others: FloatArray) -> MeanWithError:
    """The ratio r of two means over the same draws, (n,) each.

    Its standard error is that of a ratio estimator: of the mean of errors - r others, over the
    mean of the others (Cochran 1977, Sampling Techniques, chapter 6).
    """
    ratio = float(errors.mean() / others.mean())
    return MeanWithError(ratio, _standard_error(errors - ratio * others) / float(others.mean()))


def errors_by_method(outcomes: Iterable[Outcome]) -> dict[str, FloatArray]:
    """RMS (labels, repeats) of each method that ran every cell; both axes rise."""
    outcomes = sorted(outcomes, key=lambda o: (o.cell.labels, o.cell.repeat))
    labels = len({outcome.cell.labels for outcome in outcomes})
    repeats = len({outcome.cell.repeat for outcome in outcomes})
    found: dict[str, list[float]] = defaultdict(list)
    for outcome in outcomes:
        if outcome.scores is not None:
            found[outcome.cell.method].append(max(outcome.scores.rms, LEAST))
    return {
        method: np.array(values).reshape(labels, repeats)
        for method, values in found.items()
        if len(values) == labels * repeats
    }


def _standard_error(values: FloatArray) -> float:
    return float(values.std(ddof=1) / len(values) ** 0.5) if len(values) > 1 else float("nan")
