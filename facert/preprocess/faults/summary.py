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
        yield f"all weights {_when(rows)} are {value:g}, coming and going with a jump (no face)"


def _when(rows: IntArray) -> str:
    """Frames in words: ``"at frame 7"``, ``"in 90 frames from 120"``."""
    if len(rows) == 1:
        return f"at frame {rows[0]}"
    whole = rows[-1] - rows[0] + 1 == len(rows)
    return f"in {plural(len(rows), 'frame')} from {rows[0]}" + ("" if whole else f" to {rows[-1]}")


def _worst(values: FloatArray) -> str:
    """The value (n,), or position (n, 3), that is farthest from zero."""
    far = np.abs(values.reshape(len(values), -1)).max(axis=1)
    worst = np.atleast_1d(values[int(far.argmax())])
    text = ", ".join(f"{number:.3g}" for number in worst)
    return text if len(worst) == 1 else f"({text})"
