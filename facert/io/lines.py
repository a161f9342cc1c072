"""Cells of text files: lines that are cut into cells, checked widths, numbers out of rows."""

from __future__ import annotations

import csv
import logging
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from facert.data.arrays import MAX_NAMES, FloatArray
from facert.data.text import from_csv, plural
from facert.errors import InputError
from facert.io.guarded import encoding_of, existing_file, read_text

log = logging.getLogger("facert")

MAX_HEADER = 2**20
MAX_COLUMNS = 3 * MAX_NAMES + 64
"""Those of markers, and of clocks, counters and flags beside them."""
_PREAMBLE = 20  # lines before the header, at most
SEPARATORS = ",;\t"
_ALIKE = 20  # rows before the last one that it is compared with
_FIXED = 4  # decimals from which on all numbers of a column have as many by intent

# Quoted cells, in which separators do not count.
_QUOTED = re.compile(r'"(?:[^"]|"")*"')
_POINT = re.compile(r"[+-]?\d*\.\d+(?:[eE][+-]?\d+)?")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_PLAIN = re.compile(r"[+-]?\d*\.\d+")
_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*")


class Line(NamedTuple):
    """The cells of one line, and its number (from 1)."""

    number: int
    cells: list[str]

    def error(self, column: str, expected: str, found: str) -> InputError:
        """The error for a cell of a column; for the whole line without one."""
        where = f"line {self.number}" + (f", column {column}" if column else "")
        return InputError(where, expected, found, "Mend or remove the line.")


def require_few(columns: int) -> None:
    """Refuse more columns than the most markers have.

    Raises `InputError` that names the header.
    """
    if columns > MAX_COLUMNS:
        found, fix = f"{columns}", "Leave out what is not of the face."
        raise InputError("header", f"at most {MAX_COLUMNS} columns", found, fix)


def read_lines(path: Path, separator: str) -> list[Line]:
    """Read the lines of a text file, their cells stripped of blanks.

    Raises `InputError` when the file cannot be read, or a line has too many of them.
    """
    lines = read_text(path).splitlines()
    require_few(max((line.count(separator) for line in lines), default=0))
    return [
        Line(number, [cell.strip() for cell in line.split(separator)])
        for number, line in enumerate(lines, start=1)
    ]


def read_header(path: Path) -> tuple[str, ...]:
    """The cells of the first line with names, which shows the kind of a CSV file."""
    with existing_file(path).open(encoding=encoding_of(path), errors="replace") as file:
        lines = [file.readline(MAX_HEADER).rstrip("\r\n") for _ in range(_PREAMBLE + 1)]
    line = next(filter(str.strip, _without_preamble(lines)), "")
    separator = separator_of(line)
    try:
        cells = next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # whoever reads the rows says where
        cells = line.split(separator)
    return tuple(from_csv(cell.strip()) for cell in cells)


def _without_preamble(lines: Sequence[str]) -> list[str]:
    """Lines with those before the header blank: Excel's ``sep=;``, and comments behind a #."""
    bare, above = list(lines), lines[:_PREAMBLE]
    names = next((line for line in above if line.strip() and not _is_comment(line)), "")
    for number, line in enumerate(above):
        before = line.lower().startswith("sep=") or (
            _is_comment(line) and _cells(line) < _cells(names)
        )
        if line.strip() and not before:
            break
        bare[number] = ""
    return bare


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _cells(line: str) -> int:
    return line.count(separator_of(line)) + 1


def read_csv(path: Path) -> tuple[tuple[str, ...], list[Line]]:
    """Read a CSV file with a header; see `parse_csv`.

    Raises `InputError` also when the file cannot be read.
    """
    return parse_csv(read_text(path))


def parse_csv(text: str, separator: str = "") -> tuple[tuple[str, ...], list[Line]]:
    """Parse a CSV text with a header; a separator that is given is followed to the letter.

    Else it is the one that the header shows, and blanks around names do not count. An apostrophe
    before a name that would be a formula is no part of it, see `facert.data.text.for_csv`.

    Blank lines are skipped. Where the header is separated by semicolons or tabs, as Excel does in
    much of Europe, so are the rows, and their numbers may have decimal commas.

    Returns
    -------
    header : tuple of str
    rows : list of Line

    Raises
    ------
    InputError
        When there is no header, or no row.
    """
    lines = _without_preamble(text.splitlines())
    stripped = not separator
    separator = separator or separator_of(next(filter(str.strip, lines), ""))
    reader = csv.reader(lines, delimiter=separator, strict=True)
    try:
        rows = [
            Line(reader.line_num, cells)
            for cells in reader
            if cells and (cells[0].strip() or "".join(cells).strip())
        ]
    except csv.Error as error:
        line = f"line {reader.line_num}"
        raise InputError(line, "separated cells", str(error), "Export it again.") from error
    if len(rows) < 2:
        raise InputError("file", "a header and rows", plural(len(rows), "line"), "Export it again.")
    body = rows[1:] if separator == "," else with_points(rows[1:])
    header = rows[0].cells
    return tuple(from_csv(cell.strip() if stripped else cell) for cell in header), body


def separator_of(header: str) -> str:
    """The separator that gives a header the most cells; the comma where two give as many."""
    bare = _QUOTED.sub("", header)
    return max(SEPARATORS, key=bare.count)


def with_points(rows: list[Line]) -> list[Line]:
    """Decimal points for decimal commas, unless both occur: then a comma may part thousands."""
    cells = [cell.strip() for row in rows for cell in row.cells]
    if any(map(_POINT.fullmatch, cells)):
        return rows
    return [Line(row.number, list(map(_with_point, row.cells))) for row in rows]


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if "," in cell and _COMMA.fullmatch(cell) else cell


def check_width(rows: Sequence[Line], header: Sequence[str]) -> None:
    """Check that each row has one cell a column.

    Raises `InputError` naming the first line that has not.
    """
    if {len(row.cells) for row in rows} <= {len(header)}:
        return
    row = next(row for row in rows if len(row.cells) != len(header))
    raise row.error("", f"{len(header)} cells as in the header", f"{len(row.cells)}")


def without_cut_end(rows: Sequence[Line]) -> list[Line]:
    """The rows of a recording without a last one that was not finished, which the log names.

    It has fewer cells than all of those before it, or its last number stops short: a recorder that
    is killed leaves such a row. Rows in the middle are never left out.
    """
    *before, last = rows[-_ALIKE - 1 :]
    if len(before) < 2 or len({len(row.cells) for row in before}) > 1:
        return list(rows)
    width, cells = len(before[0].cells), last.cells
    if len(cells) > width or (len(cells) == width and not _stops_short(last, before)):
        return list(rows)
    log.warning("line %d, the last, is not finished and left out", last.number)
    return list(rows[:-1])


def _stops_short(last: Line, before: Sequence[Line]) -> bool:
    """Whether the last cell of a row is the beginning of a number like those above it."""
    cell, above = last.cells[-1].strip(), [row.cells[-1].strip() for row in before]
    if not cell or not all(map(_NUMBER.fullmatch, above)):
        return False
    decimals = {len(text.partition(".")[2]) for text in above}
    # Who writes zeros at the end of decimals writes them always; that of an exponent says nothing.
    zeros = any(t[-1] == "0" for t in above) and all(map(_PLAIN.fullmatch, above))
    fixed = zeros and len(decimals) == 1 and min(decimals) >= _FIXED
    short = fixed and len(cell.partition(".")[2]) < min(decimals)
    return short or _NUMBER.fullmatch(cell) is None


def to_numbers(rows: Sequence[Line], header: Sequence[str], columns: Sequence[int]) -> FloatArray:
    """Turn the cells of some columns into numbers, (rows, columns); a blank cell is NaN.

    Raises `InputError` naming the line and the column of the first cell that is no number.
    """
    chosen: list[Sequence[str]] = [row.cells for row in rows]
    if list(columns) != list(range(len(header))):
        chosen = [[cells[column] for column in columns] for cells in chosen]
    with suppress(ValueError):  # a blank cell, or no number
        return np.array(chosen, dtype=np.float64).reshape(len(rows), len(columns))
    try:
        observed = [[cell.strip() or "nan" for cell in cells] for cells in chosen]
        return np.array(observed, dtype=np.float64).reshape(len(rows), len(columns))
    except ValueError:
        raise _first_bad_cell(rows, header, columns) from None


def _first_bad_cell(
    rows: Sequence[Line], header: Sequence[str], columns: Sequence[int]
) -> InputError:
    for row in rows:
        for column in columns:
            cell = row.cells[column].strip()
            try:
                float(cell or "nan")
            except ValueError:
                return row.error(header[column], "a number", repr(cell[:40]))
    raise AssertionError("every cell is a number")  # pragma: no cover
