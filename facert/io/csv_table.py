"""Plain CSV tables with a header.

A column ``time`` (seconds) or ``frame`` (numbers at the rate that is given) comes with columns
``NAME.x NAME.y NAME.z`` (or ``NAME_x`` ...) for markers, or one column a weight. A blank cell was
not observed. Written are the poses of a take, or else its source.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.resampling import nominal_rate
from facert.data.take import Source, Take, named_columns
from facert.errors import InputError, reading
from facert.io.atomic import replacing
from facert.io.lines import check_width, read_csv, read_header, to_numbers
from facert.io.livelink import is_livelink, read_livelink

_COORDINATE = re.compile(r"(.+)[._]([xyz])", re.IGNORECASE)


def read_csv_take(path: Path, fps: float | None = None) -> Take:
    """Read a CSV file by its header: one of Live Link Face, or else a table."""
    with reading(path):
        livelink = is_livelink(read_header(path))
    return read_livelink(path) if livelink else read_table(path, fps)


def read_table(path: Path, fps: float | None = None) -> Take:
    """Read a table as a take whose source is markers or weights.

    `fps` is that of a column ``frame``; a column ``time`` needs none.

    Raises `InputError` naming the file and the line or column that is at fault.
    """
    with reading(path):
        header, rows = read_csv(path)
        check_width(rows, header)
        clock = _clock_column(header)
        columns = [column for column in range(len(header)) if column != clock]
        names, order = _source_columns([header[column] for column in columns])
        time, rate = _clock(to_numbers(rows, header, [clock])[:, 0], header[clock], fps)
        values = to_numbers(rows, header, columns)[:, order]
        source = Source(values if order.ndim == 1 else values.reshape(len(rows), -1, 3), names)
        return Take(time=time, source=source, fps=rate)


def write_table(take: Take, path: Path, overwrite: bool = False) -> None:
    """Write time and the poses of a take, or else its source, as a table.

    Raises `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    names, values = named_columns(take)
    body = io.StringIO()
    np.savetxt(body, np.column_stack([take.time, values]), fmt="%.10g", delimiter=",")
    with replacing(path, overwrite) as temporary, temporary.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow(["time", *names])
        file.write(body.getvalue().replace("nan", ""))


def _clock_column(header: Sequence[str]) -> int:
    lower = [name.lower() for name in header]
    for name in ("time", "frame"):
        if name in lower:
            return lower.index(name)
    fix = "Add one; or name the columns as Live Link Face does."
    raise InputError("header", "a column time (seconds) or frame", ", ".join(header[:4]), fix)


def _clock(values: FloatArray, column: str, fps: float | None) -> tuple[FloatArray, float]:
    """Seconds and nominal rate of a column of seconds or of frame numbers."""
    if column.lower() == "time":
        return values, nominal_rate(values)
    if fps is None:
        fix = "Add a column time, or run facert convert with --in-fps."
        raise InputError("column frame", "the rate of the frames", "none", fix)
    return values / fps, fps


def _source_columns(header: Sequence[str]) -> tuple[tuple[str, ...], IntArray]:
    """Names of the markers and their columns (M, 3); or names of the weights and theirs (D,)."""
    found = [_COORDINATE.fullmatch(name) for name in header]
    markers = list(dict.fromkeys(match[1] for match in found if match))
    place = {(match[1], match[2].lower()): i for i, match in enumerate(found) if match}
    whole = [name for name in markers if all((name, axis) in place for axis in "xyz")]
    if not whole:
        return tuple(header), np.arange(len(header))
    if 3 * len(whole) != len(header):
        in_markers = {place[name, axis] for name in whole for axis in "xyz"}
        odd = next(name for i, name in enumerate(header) if i not in in_markers)
        expected = "markers only, each with x, y and z"
        fix = "Remove it: a take's source is markers or weights, not both."
        raise InputError(f"column {odd}", expected, "another column", fix)
    return tuple(whole), np.array([[place[name, axis] for axis in "xyz"] for name in whole])
