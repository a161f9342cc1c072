"""Faults in words, by name and frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.take import Source
from facert.data.text import plural
from facert.preprocess.faults.kinds import Faults

MOST = 6
"""So many markers or weights are named for each kind, those with most faults."""
RUNS = 5
"""Of their frames, so many runs."""


def summary_lines(faults: Faults, source: Source) -> list[str]:
    """A line for frames without a face, and for each marker or weight that was far off."""
    strayed = "far from where the other markers put it"
    return [
        *_blank_lines(faults.blank, source.values),
        *_named(faults.absurd, source, _worst),
        *_named(faults.strayed, source, lambda _: strayed),
    ]


def _named(mask: BoolArray, source: Source, describe: Callable[[FloatArray], str]) -> Iterator[str]:
    """A line for each of those with most faults, and one for the others."""
    counts = mask.sum(axis=0)
    ordered = [int(index) for index in np.argsort(-counts, kind="stable") if counts[index]]
    for index in ordered[:MOST]:
        rows = np.flatnonzero(mask[:, index])
        yield f"{source.names[index]} {_when(rows)} is {describe(source.values[rows, index])}"
    if ordered[MOST:]:
        yield f"likewise {', '.join(source.names[index] for index in ordered[MOST:])}"


def _blank_lines(mask: BoolArray, values: FloatArray) -> Iterator[str]:
    """A line for the frames in which all weights are the same."""
    rows = np.flatnonzero(mask.any(axis=1))
    if len(rows):
        value = np.nanmax(values[rows[0]])
        why = "coming and going with a jump, or as hardly any weight is otherwise"
        yield f"all weights {_when(rows)} are {value:g}, {why} (no face)"


def _when(rows: IntArray) -> str:
    """Frames in words: ``"at frame 7"``, ``"in 97 frames (120 to 215, 300)"``."""
    if len(rows) == 1:
        return f"at frame {rows[0]}"
    count = plural(len(rows), "frame")
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    if len(runs) == 1:
        return f"in {count} from {rows[0]}"
    texts = [f"{run[0]}" if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in runs[:RUNS]]
    return f"in {count} ({', '.join(texts)}{', ...' if runs[RUNS:] else ''})"


def _worst(values: FloatArray) -> str:
    """The value (n,), or position (n, 3), that is farthest from zero."""
    far = np.abs(values.reshape(len(values), -1)).max(axis=1)
    worst = np.atleast_1d(values[int(far.argmax())])
    text = ", ".join(f"{number:.3g}" for number in worst)
    return text if len(worst) == 1 else f"({text})"
