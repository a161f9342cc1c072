"""One line of advice: which method to use for a take, and what more labels would bring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.text import plural
from facert.evaluation.cells import Outcome
from facert.evaluation.paired import MeanWithError, errors_by_method

LITTLE = 0.05  # a smaller gain is not worth the work of posing
FIRM = 5  # draws from which on advice can stand alone
RECENT = 3  # numbers of labels that the gain of more is judged by


def advise(outcomes: Sequence[Outcome]) -> str:
    """Advice from all outcomes of an evaluation.

    The method is the one with the least geometric mean of the RMS over labels and repeats, with
    the most unlabelled data, among those that always ran (but for numbers of labels with which
    none can). Methods are compared on the same draws: another one does as well if its distance
    over the repeats is within one standard error.
    """
    most = max(outcome.cell.unlabelled for outcome in outcomes)
    outcomes = [outcome for outcome in outcomes if outcome.cell.unlabelled == most]
    labels = sorted({outcome.cell.labels for outcome in outcomes if outcome.scores is not None})
    errors = errors_by_method([o for o in outcomes if o.cell.labels in labels])
    if not errors:
        return "No method could run every draw: see the notes below the table."
    logs = {method: np.log(table).mean(axis=0) for method, table in errors.items()}
    ranked = sorted(logs, key=lambda method: float(logs[method].mean()))
    chosen = ranked[0]
    equals = [other for other in ranked[1:] if _ties(logs[other] - logs[chosen])]
    as_good = f" ({' and '.join(equals)} within one standard error of it)" if equals else ""
    advice = f"Use {chosen} for this take{as_good}. {_about_labels(labels, errors[chosen])}"
    return advice if errors[chosen].shape[1] >= FIRM else f"{advice} Draws are few: see --repeats."


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


def _ties(behind: FloatArray) -> bool:
    """Whether the mean of a difference, one number a repeat, is within its standard error."""
    distance = MeanWithError.of(behind)
    return distance.value <= distance.se
