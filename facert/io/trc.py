"""TRC marker files (Motion Analysis, OpenSim, Vicon and others export them).

Lines of cells between tabs: ``PathFileType ...``; the names and the values of ``DataRate``,
``NumMarkers``, ``Units`` and others; ``Frame#  Time`` and the markers' names, each over three
columns; ``X1 Y1 Z1 ...``; then one line a frame. Writers mark what was not observed by blank cells
or by (0, 0, 0); some hold the last position, which `facert clean` finds. Where ``DataRate`` and the
column ``Time`` disagree, the column counts, as it does in OpenSim.

Nobody wrote the format down: blanks stand for tabs, tabs are doubled or left out, a line is
missing, counts are stale, letters are of another encoding. What the frames hold decides.
"""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.rate import BROKEN, nominal_rate, standard_rate
from facert.data.take import Source, Take
from facert.data.text import plural, printable
from facert.errors import InputError, reading
from facert.io.guarded import read_old_text
from facert.io.lines import Line, require_few, to_numbers, with_points, without_cut_end

log = logging.getLogger("facert")

_FIRST_WORD = "PathFileType"
_LEADING = 2  # Frame# and Time
_LEAD = re.compile(
    r"\s*frames?\s*(?:#|no\.?|number)?\s+time\s*(?:[(\[]?(?:s|sec|seconds)[)\]]?)?(?=\s|$)", re.I
)
_AXES = re.compile(r"[xyz]\d*", re.I)
_AXIS = re.compile(r"[\s._:-]*[xyz]$", re.I)
SLACK = 0.01
"""DataRate and the column Time agree within such a share."""


def read_trc(path: Path) -> Take:
    """Read a TRC file as a take whose source is markers, (T, M, 3) in the file's units.

    Raises `InputError` naming the file and the line or column that is at fault.
    """
    with reading(path):
        texts = read_old_text(path).splitlines()
        # Tabs may be doubled: then as many columns have nothing in them.
        require_few(max((text.count("\t") - text.count("\t\t") for text in texts), default=0))
        lines = [(number, text) for number, text in enumerate(texts, start=1) if text.strip()]
        head = next((i for i, (_, text) in enumerate(lines[:8]) if _LEAD.match(text)), 3)
        facts = _facts(lines, head)
        rows = without_cut_end(_rows(lines[head + 1 :]))
        names = _names(lines[head], rows)
        rows = [Line(row.number, _filled(row, len(names))) for row in _aligned(rows, len(names))]
        columns = ["Frame#", "Time", *(f"{name}.{axis}" for name in names for axis in "xyz")]
        values = to_numbers(rows, columns, range(1, len(columns)))
        _log_counts(facts, NumMarkers=len(names), NumFrames=len(rows))
        time, positions = values[:, 0], values[:, 1:].reshape(len(rows), -1, 3)
        _hide_zeros(positions)
        return Take(
            time=time,
            source=Source(positions, names),
            fps=_rate(facts, time),
            units=facts.get("units", ""),
        )


def _facts(lines: Sequence[tuple[int, str]], head: int) -> dict[str, str]:
    """The facts before the names, by their lower-case names; the first line is checked."""
    if len(lines) <= head or lines[0][1].split()[0].lower() != _FIRST_WORD.lower():
        found = repr(lines[0][1][:40]) if lines else "an empty file"
        raise InputError(
            "line 1", f"{_FIRST_WORD} and four more lines of a header", found, "Give a TRC file."
        )
    if head < 3:
        return {}
    names, values = _cells(lines[1][1]), _cells(lines[2][1])
    if len(list(filter(None, names))) == len(list(filter(None, values))):  # tabs may be doubled
        names, values = list(filter(None, names)), list(filter(None, values))
    return {n.lower(): v for n, v in zip(names, values, strict=False) if n}


def _cells(text: str) -> list[str]:
    """The cells of a line between tabs, or between blanks where it has no tab."""
    return [cell.strip() for cell in text.split("\t")] if "\t" in text.strip() else text.split()


def _rows(lines: Sequence[tuple[int, str]]) -> list[Line]:
    """The lines of frames with their cells; numbers may have decimal commas."""
    rows = [Line(number, _cells(text)) for number, text in lines]
    if rows and all(_AXES.fullmatch(cell) for cell in rows[0].cells if cell):
        rows = rows[1:]
    if not rows:
        raise InputError("file", "frames after the header", "none", "Export the file again.")
    return [
        Line(row.number, ["" if _lost(c) else c for c in row.cells]) for row in with_points(rows)
    ]


def _lost(cell: str) -> bool:
    """Whether a cell is a word for no number: of C's or MATLAB's, of a spreadsheet's."""
    return "#" in cell or cell.lower() in ("-", "n/a", "na", "null", "none")


def _names(line: tuple[int, str], rows: Sequence[Line]) -> tuple[str, ...]:
    """The markers, which stand each over three columns, or over every column, or between blanks."""
    number, text = line
    lead = _LEAD.match(text)
    if lead is None:
        raise InputError(
            f"line {number}", "Frame#, Time and markers", repr(text[:40]), "Export the file again."
        )
    text = text[lead.end() :]
    names, words = [cell for cell in _cells(text) if cell], text.split()
    columns = max(map(_extent, rows)) - _LEADING
    if columns == len(names):
        repeated = [_AXIS.sub("", name) for name in names]
        if repeated[::3] == repeated[1::3] == repeated[2::3]:
            return tuple(repeated[::3])
    if 3 * len(names) < columns == 3 * len(words):
        log.info("line %d: names between blanks: %s", number, printable(", ".join(words), 200))
        return tuple(words)
    return tuple(names)


def _extent(row: Line) -> int:
    """Number of cells up to the last one that is not blank."""
    return max((place for place, cell in enumerate(row.cells, start=1) if cell), default=0)


def _aligned(rows: Sequence[Line], markers: int) -> Sequence[Line]:
    """The rows without columns that are blank in all of them and too many: of doubled tabs."""
    if max(map(_extent, rows)) <= _LEADING + 3 * markers:
        return rows
    for kept, dropped in ((slice(0, None, 2), slice(1, None, 2)), (slice(1, None), slice(0, 1))):
        if not any(any(row.cells[dropped]) for row in rows):
            return [Line(row.number, row.cells[kept]) for row in rows]
    return rows


def _filled(row: Line, markers: int) -> list[str]:
    """A cell a column of these markers: trailing blanks may be left out."""
    width = _LEADING + 3 * markers
    if len(row.cells) < _LEADING or any(row.cells[width:]):
        raise row.error("", f"{width} cells for the markers of the header", f"{len(row.cells)}")
    return (row.cells + [""] * width)[:width]


def _log_counts(facts: dict[str, str], **counted: int) -> None:
    """Log the counts in the header that are not those of the file, which count."""
    for name, count in counted.items():
        stated = facts.get(name.lower(), "")
        try:
            agrees = not stated or float(stated) == count
        except ValueError:
            agrees = False
        if not agrees:
            there = printable(stated)
            log.info("%s is %s in the header; the file has %d, which counts", name, there, count)


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
        stated = standard_rate(float(facts["datarate"]))
    except (KeyError, ValueError):
        return shown
    if not math.isfinite(stated):
        return shown
    if not (np.diff(time) > 0).all() or _agrees(stated, shown, time):
        return shown if shown in BROKEN else stated
    log.warning("DataRate is %g frames/s, the column Time %.4g: the column counts", stated, shown)
    return shown


def _agrees(stated: float, shown: float, time: FloatArray) -> bool:
    """Whether frames have this spacing usually, or on average where times are rounded."""
    frames = stated * (time[-1] - time[0])
    return abs(stated - shown) <= SLACK * shown or abs(frames - len(time) + 1) <= SLACK * frames
