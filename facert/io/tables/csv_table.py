"""Plain CSV tables with a header.

A column of times (seconds, another unit, a date or a timecode) or of frame numbers comes with
columns ``NAME.x NAME.y NAME.z`` (or spelled otherwise) for markers, or one column a weight. A blank
cell was not observed. Written are the poses of a take, or else its source.

Where a table of facert's own would be read otherwise, as with a control called ``frame``, its first
cell states what the columns are: ``time (weights)`` or ``time (markers)``. Names and times are then
exactly those of the file.

The first cell is quoted, though it need not be, and no other: programs read the table as any other,
and by that facert knows it for its own, which may be replaced.
"""

from __future__ import annotations

import csv
import io
import logging
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.columns import learnable, require_there
from facert.data.rate import nominal_rate
from facert.data.take import Source, Take, named_columns
from facert.data.text import for_csv, from_csv, printable
from facert.errors import InputError, reading
from facert.io.atomic import write_text
from facert.io.guarded import encoding_of, read_beginning, read_text
from facert.io.lines import (
    MAX_HEADER,
    Line,
    check_width,
    parse_csv,
    read_header,
    require_few,
    to_numbers,
    without_cut_end,
)
from facert.io.tables.coordinates import markers_among
from facert.io.tables.curve_table import is_curve_table, read_csv_curves
from facert.io.tables.livelink import is_livelink, read_livelink
from facert.io.tables.marker_header import marker_header
from facert.io.tables.table import Table, is_number, is_text, table_of_lines
from facert.io.tables.table_take import Reading, take_of_table, unlogged

LARGEST = 1.797693134e308
"""Ten digits of the largest number there is: rounded to ten, it would be infinite."""
CURVE = "iteration,objective,gradient_norm,seconds"
"""The first line of the curve of a training, a table that is never read."""

log = logging.getLogger("facert")

_MARKS = {"weights": "time (weights)", "markers": "time (markers)"}
_LONGEST = max(map(len, _MARKS.values()))
_NUMBER = re.compile(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?")


def read_csv_take(
    path: Path, fps: float | None = None, keep: Sequence[str] = (), sparse: bool = False
) -> Take:
    """Read a CSV file by its header: of Live Link Face, of Unreal, or a table; see `read_table`."""
    with reading(path):
        header = read_header(path)
        if is_livelink(header):
            require_there(keep, header)
            return learnable(read_livelink(path, fps), keep, sparse)
        if header and is_curve_table(header):
            return read_csv_curves(read_text(path))
        require_few(len(header))
        return read_table(path, fps, keep, sparse)


def read_table(
    path: Path, fps: float | None = None, keep: Sequence[str] = (), sparse: bool = False
) -> Take:
    """Read a table as a take whose source is markers or weights.

    Parameters
    ----------
    fps : float, optional
        The rate of a table that has frame numbers or no clock at all.
    keep : sequence of str
        Columns that are weights though they look like a clock, a counter or a flag.
    sparse : bool
        Whether the rows are poses of single frames: never markers, and far apart in time.

    Raises `InputError` naming the file and the line or column that is at fault.
    """
    with reading(path):
        text = read_text(path)
        if _is_marked(text):
            return _read_marked(text)
        header, rows = parse_csv(text)
        rows = rows if sparse else without_cut_end(rows)
        above = marker_header([Line(1, list(header)), *rows])
        if above is not None:
            table = table_of_lines(above.names, above.body)
            take = take_of_table(table, Reading(above.rate or fps, tuple(keep), sparse))
            return replace(take, units=above.unit)
        _require_names(header, rows)
        return take_of_table(table_of_lines(header, rows), Reading(fps, tuple(keep), sparse))


def is_marked(path: Path) -> bool:
    """Whether the first cell of a table states what its columns are."""
    with path.open(encoding=encoding_of(path), errors="replace") as file:
        return _is_marked(file.read(2 * _LONGEST))


def write_table(take: Take, path: Path, overwrite: bool = False) -> None:
    """Write time and the poses of a take, or else its source, as a table.

    Raises `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    names, values = named_columns(take)
    markers = take.params is None and take.source.kind == "markers"
    mark = _MARKS["markers" if markers else "weights"]
    plain = _header(["time", *names])
    own = _is_own(plain) and _reads_back(names, take.time, values, markers)
    header = plain if own else _header([mark, *names])
    write_text(header + _body(take.time, values).replace("nan", ""), path, overwrite)
    if take.start_timecode:
        log.info("a table has no start timecode: %s is left out", printable(take.start_timecode))


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a table, or the curve of a training."""
    beginning = read_beginning(path, MAX_HEADER).decode(errors="replace")
    return beginning.startswith(f"{CURVE}\n") or _is_own(beginning)


def _is_own(text: str) -> bool:
    """Whether a table that begins so is facert's: its first line is as `_header` writes it.

    Some writers quote all names, or all text. Where that would be the same line, the first cell
    must state what the columns are.
    """
    cells = [from_csv(cell) for cell in next(csv.reader(io.StringIO(text, newline="")), [])]
    if not cells or not text.startswith(_header(cells)):
        return False
    unquoted = [cell for cell in map(for_csv, cells[1:]) if not cell.startswith('"')]
    return cells[0] in _MARKS.values() or not all(map(_NUMBER.fullmatch, unquoted))


def _is_marked(text: str) -> bool:
    return text.lstrip('"').lower().startswith(tuple(_MARKS.values()))


def _read_marked(text: str) -> Take:
    """A table whose first cell states what the others are."""
    after = text.index(")") + 1
    header, rows = parse_csv(text, text[after:].lstrip('"')[:1] or ",")
    rows = without_cut_end(rows)
    check_width(rows, header)
    numbers = to_numbers(rows, header, range(len(header)))
    time, values, names = numbers[:, 0], numbers[:, 1:], header[1:]
    if header[0].lower() == _MARKS["markers"]:
        found = markers_among(names, values, sure=True)
        if found is None:
            fix = f"Name them so, or write {_MARKS['weights']!r} first."
            raise InputError("header", "NAME.x, NAME.y, NAME.z for all", header[1], fix)
        return Take(time, Source(values[:, found.columns], found.names), fps=nominal_rate(time))
    return Take(time, Source(values, names), fps=nominal_rate(time))


def _require_names(header: Sequence[str], rows: Sequence[Line]) -> None:
    """Refuse a first line of numbers, and a second one of names."""
    numbers = [column for column, cell in enumerate(rows[-1].cells) if is_number(cell)]
    cells = [rows[0].cells[column].strip() for column in numbers if column < len(rows[0].cells)]
    names = list(filter(is_text, cells))
    if 2 * len(names) > len(numbers):
        fix = "Leave one line of names: of the weights, or NAME.x, NAME.y, NAME.z."
        found = f"names again, such as {names[-1][:40]!r}"
        raise InputError(f"line {rows[0].number}", "numbers below the header", found, fix)
    if all(map(_NUMBER.fullmatch, header)) and any("." in cell for cell in header):
        found, fix = "numbers only", "Write the names of the columns into a first line."
        raise InputError("header", "names of the columns", found, fix)


def _body(time: FloatArray, values: FloatArray) -> str:
    """The rows of a table; times are written in full where ten digits do not distinguish them."""
    body = io.StringIO()
    formats = ["%.10g" if _is_short(time) else "%.17g", *["%.10g"] * values.shape[1]]
    finite = np.clip(values, -LARGEST, LARGEST)  # NaN stays
    np.savetxt(body, np.column_stack([time, finite]), fmt=formats, delimiter=",")
    return body.getvalue()


def _is_short(time: FloatArray) -> bool:
    """Whether ten digits distinguish times (T,)."""
    short = np.array([float(f"{one:.10g}") for one in (time[0], time[-1])])
    return bool(np.abs(short - time[[0, -1]]).max() <= 1e-7 and (np.diff(time) > 1e-5).all())


def _in_digits(values: FloatArray) -> FloatArray:
    """Values to ten digits, as they are written."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        places = np.power(10.0, 9 - np.floor(np.log10(np.abs(values))))
        rounded = np.rint(values * places) / places
    return np.where(np.isfinite(rounded), rounded, values)


def _header(cells: Sequence[str]) -> str:
    """The first line of a table, with quotes around its first cell, and around others as needed."""
    first, *others = cells
    return ",".join([f'"{first}"', *map(for_csv, others)]) + "\n"


def _reads_back(names: Sequence[str], time: FloatArray, values: FloatArray, markers: bool) -> bool:
    """Whether a table of these columns is read as what it is without more in its header.

    Weights may be read as poses as well.
    """
    seconds = _in_digits(time) if _is_short(time) else time
    numbers = np.column_stack([seconds, _in_digits(values)])
    expected = [name[:-2] for name in names[::3]] if markers else list(names)
    try:
        header, _ = parse_csv(_header(["time", *names]) + "0\n")
        if header != ("time", *names):
            return False
        table = Table(header, numbers, {}, "row {}".format)
        ways = [Reading()] if markers else [Reading(), Reading(sparse=True)]
        with unlogged():
            takes = [take_of_table(table, way) for way in ways]
    except InputError:
        return False
    return all(
        list(take.source.names) == expected
        and np.array_equal(take.source.matrix, numbers[:, 1:], equal_nan=True)
        and np.array_equal(take.time, numbers[:, 0])
        for take in takes
    )
