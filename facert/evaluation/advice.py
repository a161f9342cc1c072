"""One line of advice: which method to use for a take, and what more labels would bring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.text import plural
from facert.evaluation.cells import Outcome
from facert.evaluation.paired import MeanWithError, errors_by_method
from facert.settings import Settings

DEFAULT = Settings().method
LITTLE = 0.05  # a smaller gain is not worth the work of posing
FIRM = 5  # draws from which on advice can stand alone
RECENT = 3  # numbers of labels that the gain of more is judged by


def advise(outcomes: Sequence[Outcome], tested: int | None = None, chosen: bool = False) -> str:
    """Advice from all outcomes of an evaluation.

    The method is the one with the least mean RMS at the most labels, the number that is nearest to
    what the take has: the table's number. With the most unlabelled data, among the methods that
    always ran (but for numbers of labels with which none can). The default is named unless another
    is ahead by more than a standard error of the difference over the same draws.

    Parameters
    ----------
    outcomes : sequence of Outcome
    tested : int, optional
        Frames that each draw was tested on.
    chosen : bool
        Whether these were chosen to be posed, and are no ordinary ones.
    """
    most = max(outcome.cell.unlabelled for outcome in outcomes)
    outcomes = [outcome for outcome in outcomes if outcome.cell.unlabelled == most]
    labels = sorted({outcome.cell.labels for outcome in outcomes if outcome.scores is not None})
    errors = errors_by_method([o for o in outcomes if o.cell.labels in labels])
    if not errors:
        return "No method could run every draw: see the notes below the table."
    last = {method: table[-1] for method, table in errors.items()}
    best = min(last, key=lambda method: float(last[method].mean()))
    named = DEFAULT if DEFAULT in last and not _beaten(last[DEFAULT] - last[best]) else best
    equals = [other for other in last if other != named and _ties(last[other] - last[named])]
    equals.sort(key=lambda method: float(last[method].mean()))
    as_good = f" ({' and '.join(equals)} within one standard error of it)" if equals else ""
    parts = [f"Use {named} for this take{as_good}.", _about_labels(labels, errors[named])]
    parts += [] if tested is None else [_about_tests(tested, chosen)]
    parts += ["Draws are few: see --repeats."] if errors[named].shape[1] < FIRM else []
    return " ".join(parts)


def _about_tests(tested: int, chosen: bool) -> str:
    """What the error is of."""
    frames = f"Tested on {plural(tested, 'posed frame')} a draw"
    if not chosen:
        return f"{frames}."
    return f"{frames}, which are extremes if they were suggested: ordinary frames err less."


def _about_labels(labels: Sequence[int], errors: FloatArray) -> str:
    """Advice on more labels, from the RMS at each number of labels, (labels, repeats)."""
    means = errors.mean(axis=1)
    seen = f"RMS {means[0]:.3g} with {plural(labels[0], 'label')}"
    if len(labels) == 1:
        return f"{seen}; evaluate a range of labels to see what more would bring."
    seen += f", {means[-1]:.3g} with {labels[-1]}"
    slope = np.polyfit(np.log(labels[-RECENT:]), np.log(means[-RECENT:]), 1)[0]
    gain = 1.0 - 2.0**slope
    if gain < LITTLE:
        return f"{seen}; more labels would bring little."
    return f"{seen}; at this rate {2 * labels[-1]} labels would take off another {gain:.0%}."


def _beaten(behind: FloatArray) -> bool:
    """Whether the mean of a difference, one number a draw, is above its standard error."""
    distance = MeanWithError.of(behind)
    return distance.value > distance.se  # not by a single draw, which has none


def _ties(behind: FloatArray) -> bool:
    """Whether the mean of a difference is within its standard error."""
    distance = MeanWithError.of(behind)
    return distance.value <= distance.se
