"""TRC marker files (Motion Analysis, OpenSim, Vicon and others export them).

Lines of cells between tabs: ``PathFileType ...``; the names and the values of ``DataRate``,
``NumMarkers``, ``Units`` and others; ``Frame#  Time`` and the markers' names, each over three
columns; ``X1 Y1 Z1 ...``; then one line a frame. Writers mark what was not observed by blank cells
or by (0, 0, 0); some hold the last position, which `facert clean` finds. Where ``DataRate`` and the
column ``Time`` disagree, the column counts, as it does in OpenSim.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.resampling import nominal_rate
from facert.data.take import Source, Take
from facert.data.text import plural
from facert.errors import InputError, reading
from facert.io.lines import Line, read_lines, to_numbers

log = logging.getLogger("facert")

_FIRST_WORD = "PathFileType"
_LEADING = 2  # Frame# and Time
SLACK = 0.01
"""DataRate and the column Time agree within such a share."""


def read_trc(path: Path) -> Take:
    """Read a TRC file as a take whose source is markers, (T, M, 3) in the file's units.

    Raises `InputError` naming the file and the line or column that is at fault.
    """
    with reading(path):
        lines = read_lines(path, "\t")
        facts, names = _header(lines[:5])
        rows = _frames(lines[5:], names)
        columns = ["Frame#", "Time", *(f"{name}.{axis}" for name in names for axis in "xyz")]
        values = to_numbers(rows, columns, range(1, len(columns)))
        time, positions = values[:, 0], values[:, 1:].reshape(len(rows), -1, 3)
        _hide_zeros(positions)
        return Take(
            time=time,
            source=Source(positions, names),
            fps=_rate(facts, time),
            units=facts.get("units", ""),
        )


def _header(lines: Sequence[Line]) -> tuple[dict[str, str], tuple[str, ...]]:
    """Facts by their lower-case names, and the markers, from the five lines before the frames."""
    if len(lines) < 5 or lines[0].cells[0] != _FIRST_WORD:
        found = repr(lines[0].cells[0][:40]) if lines else "an empty file"
        raise InputError(
            "line 1", f"{_FIRST_WORD} and four more lines of a header", found, "Give a TRC file."
        )
    facts = dict(zip(map(str.lower, lines[1].cells), lines[2].cells, strict=False))
    cells = lines[3].cells
    if [cell.lower() for cell in cells[:_LEADING]] != ["frame#", "time"]:
        raise InputError(
            "line 4", "Frame#, Time and markers", repr(cells[:3]), "Export the file again."
        )
    names = tuple(cell for cell in cells[_LEADING:] if cell)
    stated = facts.get("nummarkers", str(len(names)))
    if stated != str(len(names)):
        raise InputError(
            "line 4", f"{stated} markers, as in NumMarkers", f"{len(names)}", "Export it again."
        )
    return facts, names


def _frames(lines: Sequence[Line], names: Sequence[str]) -> list[Line]:
    """The lines that are not blank, each with a cell a column: trailing blanks may be left out."""
    width = _LEADING + 3 * len(names)
    rows = [Line(row.number, _filled(row, width)) for row in lines if any(row.cells)]
    if not rows:
        raise InputError("file", "frames after the header", "none", "Export the file again.")
    return rows


def _filled(row: Line, width: int) -> list[str]:
    if len(row.cells) < _LEADING or any(row.cells[width:]):
        raise row.error("", f"{width} cells for the markers of the header", f"{len(row.cells)}")
    return (row.cells + [""] * width)[:width]


def _hide_zeros(positions: FloatArray) -> None:
    """Set to NaN what lies exactly at the origin."""
    lost = (positions == 0).all(axis=2)
    if lost.any():
        log.info("not observed: %s at (0, 0, 0)", plural(int(lost.sum()), "position"))
    positions[lost] = np.nan


def _rate(facts: dict[str, str], time: FloatArray) -> float:
    """Frames a second as the header states it, unless the times of the frames contradict it."""
    shown = nominal_rate(time)
    try:
        stated = float(facts["datarate"])
    except (KeyError, ValueError):
        return shown
    if not math.isfinite(stated):
        return shown
    if not (np.diff(time) > 0).all() or _agrees(stated, shown, time):
        return stated
    log.warning("DataRate is %g frames/s, the column Time %.4g: the column counts", stated, shown)
    return shown


def _agrees(stated: float, shown: float, time: FloatArray) -> bool:
    """Whether frames have this spacing usually, or on average where times are rounded."""
    frames = stated * (time[-1] - time[0])
    return abs(stated - shown) <= SLACK * shown or abs(frames - len(time) + 1) <= SLACK * frames
