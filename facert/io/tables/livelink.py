"""Live Link Face CSV, both ways.

One row an observation: ``Timecode,BlendShapeCount``, then the 52 ARKit shapes and nine angles in
radians. Columns are found by name: 51, 52 and 61 of them occur, in several spellings. Rows come
with gaps, and a row whose count is 0 saw no face.

The app counts FF of a timecode in 1/60 s whatever the rate of the rows, with thousandths; other
writers of the same table count the frames of their own rate, drop-frame, or milliseconds. Which a
file does, its rows show: see `facert.data.timecode_column`.
"""

from __future__ import annotations

import csv
import io
import logging
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.clock import rising
from facert.data.names import ARKIT_NAMES, NameIndex, canonical, nearest
from facert.data.rate import AGREES, frames_at, frames_shown, nominal_rate, rate_shown, whole_count
from facert.data.resampling import EVEN
from facert.data.take import Source, Take, named_curves
from facert.data.text import plural
from facert.data.timecode import (
    LIVE_LINK_RATE,
    TICKS,
    format_timecode,
    has_thousandths,
    is_drop_frame,
    parse_timecode,
    parts_of,
    timecode,
)
from facert.data.timecode_column import TimecodeClock, read_timecodes
from facert.errors import InputError, reading
from facert.io.atomic import write_text
from facert.io.guarded import read_beginning
from facert.io.lines import Line, check_width, read_csv, to_numbers, without_cut_end

log = logging.getLogger("facert")

_LEADING = ("Timecode", "BlendShapeCount")
# The app writes 10 decimals; one more does no importer harm, and shows that facert wrote the file.
# Importers look for the header, unquoted, and take every further column for a shape.
_DECIMALS = 11
_ROW = re.compile(
    rb"\n[^,\n]*,%d(?:,-?\d+\.\d{%d}){%d}\n" % (len(ARKIT_NAMES), _DECIMALS, len(ARKIT_NAMES))
)
_BEGINNING = 2**16  # bytes that have a row with a face


def is_livelink(header: Sequence[str]) -> bool:
    """Whether a CSV file with this header is one of Live Link Face."""
    return tuple(cell.lower() for cell in header[:2]) == tuple(name.lower() for name in _LEADING)


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a Live Link Face CSV, by the number of decimals."""
    return _ROW.search(read_beginning(path, _BEGINNING)) is not None


def read_livelink(path: Path, fps: float | None = None) -> Take:
    """Read a Live Link Face CSV as a take whose source is weights, named as ARKit does.

    Rows without a face, and rows that do not come after the one before, are dropped and counted
    in the log. `fps` is the rate of the rows, where it is known: it helps to find what FF count.

    Raises `InputError` naming the file and the line that is at fault.
    """
    with reading(path):
        header, rows = read_csv(path)
        if not is_livelink(header):
            raise InputError(
                "header", ",".join(_LEADING), ",".join(header[:2]), "Give a Live Link Face CSV."
            )
        rows = without_cut_end(_rows_with_face(rows))
        check_width(rows, header)
        clock = _clock(rows, fps)
        values = to_numbers(rows, header, range(2, len(header)))
        kept, time = rising(clock.seconds, values, lambda row: f"line {rows[row].number}")
        rate = nominal_rate(time)
        if fps is not None and clock.is_exact:
            _require_agrees(fps, time)
        return Take(
            time=time,
            source=Source(values[kept], _canonical_columns(header[2:])),
            fps=rate,
            start_timecode=clock.start(rate),
            clock_start=clock.first_ticks / TICKS,
        )


def write_livelink(take: Take, path: Path, overwrite: bool = False) -> None:
    """Write the poses of a take, or else its source weights, as a Live Link Face CSV.

    All 61 columns are written as the app does; names that the take does not have are 0. Frames
    without a pose become rows without a face.

    Raises `InputError` when the controls or weights are not ARKit's, or only a part of a frame is
    known, and `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    with reading(path):
        codes, columns = _timecodes(take), _known_columns(take)
    known = np.asarray(~np.isnan(columns).all(axis=1))
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow([*_LEADING, *(name[0].upper() + name[1:] for name in ARKIT_NAMES)])
    writer.writerows(_rows(codes, columns, known))
    write_text(table.getvalue(), path, overwrite)
    if not known.all():
        unposed = plural(int(np.sum(~known)), "frame")
        log.info("%s without a pose: rows without a face", unposed)


def _known_columns(take: Take) -> FloatArray:
    """The numbers to write (T, 61); a row of NaN is a frame without a face."""
    columns = _arkit_columns(take)
    known = np.asarray(~np.isnan(columns).all(axis=1))
    if np.isnan(columns[known]).any():
        expected, found = "frames that are known as a whole", "frames that are known in part"
        fix = "Fill the gaps first (facert retarget does), or write a .csv table."
        raise InputError("/source/weights", expected, found, fix)
    return columns


def _timecodes(take: Take) -> list[str]:
    """The timecodes of the frames: in sixtieths, or drop-frame as that of the first."""
    code = take.start_timecode or "00:00:00:00.000"
    frames = frames_at(take.time, take.fps, EVEN) if is_drop_frame(code, take.fps) else None
    if frames is not None:
        return [timecode(code, frame / take.fps, take.fps) for frame in frames.tolist()]
    counted = LIVE_LINK_RATE if has_thousandths(code) else whole_count(take.fps)
    start = parse_timecode(code, counted)
    if start is None:  # FF beyond the rate: the app's sixtieths, written short
        start = parse_timecode(code)
    if start is None:
        found = take.start_timecode
        raise InputError("start_timecode", "HH:MM:SS:FF.mmm", found, "Correct the attribute.")
    ticks = start + np.rint(take.time * TICKS).astype(np.int64)
    return [format_timecode(tick) for tick in ticks.tolist()]


def _rows_with_face(rows: Sequence[Line]) -> list[Line]:
    kept = [row for row in rows if _saw_face(row)]
    if len(kept) < len(rows):
        dropped = len(rows) - len(kept)
        text = (
            "dropped %d of %d rows without a face: frames are counted without them, unlike those "
            "of its video (timecodes agree; facert convert --fps gives every frame)"
        )
        log.info(text, dropped, len(rows))
    if not kept:
        fix = "Record again with the face in view."
        raise InputError("BlendShapeCount", "rows with a face", "none", fix)
    return kept


def _saw_face(row: Line) -> bool:
    """Whether the row counts any shapes; a row may end after its timecode."""
    count = "".join(row.cells[1:2]).strip()
    try:
        return float(count or 0) > 0
    except ValueError:
        expected = "the number of shapes, or 0 for no face"
        raise row.error(_LEADING[1], expected, repr(count[:40])) from None


def _clock(rows: Sequence[Line], fps: float | None) -> TimecodeClock:
    """The clock of the rows by their timecodes."""
    codes = [parts_of(row.cells[0]) for row in rows]
    known = [code for code in codes if code is not None]
    clock = read_timecodes(known, fps) if len(known) == len(rows) else None
    if clock is None:
        row = rows[0] if None not in codes else rows[codes.index(None)]
        raise row.error(_LEADING[0], "HH:MM:SS:FF.mmm", repr(row.cells[0][:40]))
    return clock


def _require_agrees(fps: float, time: FloatArray) -> None:
    """Refuse a rate that contradicts known times (T,), unless it can count their frames anew."""
    shown, frames = rate_shown(time), frames_shown(time)
    even = frames is None or frames[-1] + 1 == len(time)  # who counts anew refuses uneven ones
    if not even and abs(shown - fps) > AGREES * fps:
        expected = f"about {shown:.4g}, as timecodes with rows missing among them show"
        fix = "Leave it out; --fps N resamples by time."
        raise InputError("--in-fps", expected, f"{fps:.6g}", fix)


def _canonical_columns(header: Sequence[str]) -> tuple[str, ...]:
    """ARKit's spelling of the columns; a column that is not ARKit's stays, with a warning."""
    names = tuple(canonical(column) for column in header)
    for name in (name for name in names if name not in ARKIT_NAMES):
        near = nearest(name, ARKIT_NAMES)
        hint = f"; did you mean {near}?" if near else ""
        log.warning("column %r is not one of Live Link Face%s", name, hint)
    return names


def _arkit_columns(take: Take) -> FloatArray:
    """The poses, else the source weights, in the order of the CSV, (T, 61)."""
    names, values = named_curves(take)
    field = "/source/names" if take.params is None else "/target/names"
    index = NameIndex.among(ARKIT_NAMES, names, field)
    foreign = [name for name in names if index.find(name) is None]
    if foreign:
        near = nearest(foreign[0], ARKIT_NAMES)
        found = f"{foreign[0]!r}" + (f" (nearest: {near!r})" if near else "")
        fix = "Write a plain table, with a name that ends in .csv but not in .livelink.csv."
        raise InputError(field, "ARKit shapes and angles", found, fix)
    columns = np.zeros((len(values), len(ARKIT_NAMES)))
    columns[np.isnan(values).all(axis=1)] = np.nan
    columns[:, index.places(names, field)] = values
    if len(names) < len(ARKIT_NAMES):
        absent = plural(len(ARKIT_NAMES) - len(names), "column")
        log.info("%s that the take has not: 0", absent)
    return columns


def _rows(codes: Sequence[str], columns: FloatArray, known: BoolArray) -> list[list[str]]:
    """The cells of the file, one list a frame."""
    template = ",".join([f"%.{_DECIMALS}f"] * columns.shape[1])
    count = str(columns.shape[1])
    return [
        [code, count, *(template % tuple(row)).split(",")] if face else [code, "0"]
        for code, row, face in zip(codes, columns.tolist(), known, strict=True)
    ]
