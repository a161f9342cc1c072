"""Live Link Face CSV, both ways.

One row an observation: ``Timecode,BlendShapeCount``, then the 52 ARKit shapes and nine angles in
radians. Columns are found by name: 51, 52 and 61 of them occur, in several spellings. Rows come
with gaps, and a row whose count is 0 saw no face.

The app counts FF of a timecode in 1/60 s whatever the rate of the rows, with thousandths; other
writers of the same table count the frames of their own rate, 24 to 50 a second. Which of both a
file does shows where the seconds change.
"""

from __future__ import annotations

import csv
import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.clock import rising
from facert.data.names import ARKIT_NAMES, NameIndex, canonical, nearest
from facert.data.rate import nominal_rate
from facert.data.take import Source, Take, named_curves
from facert.data.text import plural
from facert.data.timecode import (
    DAY,
    LIVE_LINK_RATE,
    TICKS,
    format_timecode,
    has_thousandths,
    parse_timecode,
)
from facert.errors import InputError, reading
from facert.io.atomic import replacing
from facert.io.lines import Line, check_width, read_csv, to_numbers

log = logging.getLogger("facert")

_LEADING = ("Timecode", "BlendShapeCount")
_OTHER_COUNTS = (24, 25, 30, 48, 50)
# So many steps within seconds, and from one second to the next, show what a second counts.
_ENOUGH_STEPS, _ENOUGH_SECONDS = 10, 2


def is_livelink(header: Sequence[str]) -> bool:
    """Whether a CSV file with this header is one of Live Link Face."""
    return tuple(cell.lower() for cell in header[:2]) == tuple(name.lower() for name in _LEADING)


def read_livelink(path: Path) -> Take:
    """Read a Live Link Face CSV as a take whose source is weights, named as ARKit does.

    Rows without a face, and rows that do not come after the one before, are dropped and counted
    in the log.

    Raises `InputError` naming the file and the line that is at fault.
    """
    with reading(path):
        header, rows = read_csv(path)
        if not is_livelink(header):
            raise InputError(
                "header", ",".join(_LEADING), ",".join(header[:2]), "Give a Live Link Face CSV."
            )
        rows = _rows_with_face(rows)
        check_width(rows, header)
        ticks, count = _clock(rows)
        values = to_numbers(rows, header, range(2, len(header)))
        kept, time = rising((ticks - ticks[0]) / TICKS, values)
        rate = nominal_rate(time)
        return Take(
            time=time,
            source=Source(values[kept], _canonical_columns(header[2:])),
            fps=rate,
            start_timecode=_start(rows[0].cells[0].strip(), int(ticks[0]), count, rate),
        )


def write_livelink(take: Take, path: Path, overwrite: bool = False) -> None:
    """Write the poses of a take, or else its source weights, as a Live Link Face CSV.

    All 61 columns are written as the app does; names that the take does not have are 0. Frames
    without a pose become rows without a face.

    Raises `InputError` when the controls or weights are not ARKit's, or only a part of a frame is
    known, and `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    with reading(path):
        ticks, columns = _ticks_and_columns(take)
    known = np.asarray(~np.isnan(columns).all(axis=1))
    with replacing(path, overwrite) as temporary, temporary.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*_LEADING, *(name[0].upper() + name[1:] for name in ARKIT_NAMES)])
        writer.writerows(_rows(ticks, columns, known))
    if not known.all():
        unposed = plural(int(np.sum(~known)), "frame")
        log.info("%s without a pose: rows without a face", unposed)


def _ticks_and_columns(take: Take) -> tuple[IntArray, FloatArray]:
    """The ticks since midnight (T,), and the numbers to write (T, 61)."""
    columns = _arkit_columns(take)
    known = np.asarray(~np.isnan(columns).all(axis=1))
    if np.isnan(columns[known]).any():
        expected, found = "frames that are known as a whole", "frames that are known in part"
        fix = "Fill the gaps first (facert retarget does), or write a .csv table."
        raise InputError("/source/weights", expected, found, fix)
    code = take.start_timecode or "00:00:00:00.000"
    counted = LIVE_LINK_RATE if has_thousandths(code) else max(1, round(take.fps))
    start = parse_timecode(code, counted)
    if start is None:  # FF beyond the rate: the app's sixtieths, written short
        start = parse_timecode(code)
    if start is None:
        found = take.start_timecode
        raise InputError("start_timecode", "HH:MM:SS:FF.mmm", found, "Correct the attribute.")
    return start + np.rint(take.time * TICKS).astype(np.int64), columns


def _rows_with_face(rows: Sequence[Line]) -> list[Line]:
    kept = [row for row in rows if _saw_face(row)]
    if len(kept) < len(rows):
        dropped = len(rows) - len(kept)
        text = "dropped %d of %d rows without a face: frames are counted without them"
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


def _clock(rows: Sequence[Line]) -> tuple[IntArray, int]:
    """Ticks of the rows (T,), and how many FF of their timecodes make a second."""
    ticks = [_row_ticks(row) for row in rows]
    count = _counted(ticks)
    if count != LIVE_LINK_RATE:
        log.info("timecodes count %d frames a second", count)
        ticks = [tick // TICKS * TICKS + tick % TICKS * LIVE_LINK_RATE // count for tick in ticks]
    clock = np.array(ticks, dtype=np.int64)
    new_days = np.diff(clock, prepend=clock[:1]) < -DAY // 2  # time goes on past midnight
    return clock + DAY * np.cumsum(new_days), count


def _counted(ticks: Sequence[int]) -> int:
    """Ticks FF a second, counted from those of the rows (T,); else 60 as in the app.

    Where FF wraps from one second to the next, its usual step goes on only with the right count.
    """
    seconds, frames = np.divmod(np.asarray(ticks, dtype=np.float64), TICKS)
    frames *= LIVE_LINK_RATE / TICKS
    steps, passed = np.diff(frames), np.diff(seconds)
    within, across = steps[passed == 0], steps[passed == 1]
    if len(within) < _ENOUGH_STEPS or len(across) < _ENOUGH_SECONDS:
        return LIVE_LINK_RATE
    shown = np.median(np.median(within) - across)
    fitting = [n for n in _OTHER_COUNTS if abs(shown - n) < 0.5 and frames.max() < n]
    return fitting[0] if fitting else LIVE_LINK_RATE


def _start(code: str, ticks: int, count: int, rate: float) -> str:
    """The first timecode, of these ticks, so that its count shows when it is read alone.

    With thousandths that is 1/60 s, without them frames at the take's own rate.
    """
    if count == (LIVE_LINK_RATE if has_thousandths(code) else round(rate)):
        return code
    return format_timecode(ticks)


def _row_ticks(row: Line) -> int:
    ticks = parse_timecode(row.cells[0])
    if ticks is None:
        raise row.error(_LEADING[0], "HH:MM:SS:FF.mmm", repr(row.cells[0][:40]))
    return ticks


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


def _rows(ticks: IntArray, columns: FloatArray, known: BoolArray) -> list[list[str]]:
    """The cells of the file, one list a frame."""
    template = ",".join(["%.10f"] * columns.shape[1])
    count = str(columns.shape[1])
    return [
        [format_timecode(tick), count, *(template % tuple(row)).split(",")]
        if face
        else [format_timecode(tick), "0"]
        for tick, row, face in zip(ticks.tolist(), columns.tolist(), known, strict=True)
    ]
