"""The guarded door for text: existing, not too large, UTF-8; and numbers out of rows of cells."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray
from facert.errors import InputError

MAX_BYTES = 2**29
"""Largest text file that is read: half a gibibyte."""
MAX_HEADER = 2**20
SEPARATORS = ",;\t"

_POINT = re.compile(r"[+-]?\d*\.\d+(?:[eE][+-]?\d+)?")
_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")


@dataclass(frozen=True)
class Row:
    """The cells of one line of a CSV file, and that line's number (from 1)."""

    line: int
    cells: list[str]


def existing_file(path: Path) -> Path:
    """Check that `path` is a file that may be read.

    Raises
    ------
    InputError
        When there is nothing, a folder, or a file without permission.
    """
    if not (path.is_file() and os.access(path, os.R_OK)):
        found = "a folder" if path.is_dir() else "no permission" if path.exists() else "nothing"
        raise InputError("file", "an existing file", found, "Check the name.", where=str(path))
    return path


def read_text(path: Path) -> str:
    """Read a UTF-8 text file, with or without a byte order mark.

    Raises
    ------
    InputError
        When the file is missing, too large or not UTF-8.
    """
    size = existing_file(path).stat().st_size
    if size > MAX_BYTES:
        raise InputError("file", f"at most {MAX_BYTES} bytes", f"{size}", "Cut it into parts.")
    try:
        return path.read_text(encoding="utf-8-sig")
    except (UnicodeDecodeError, OSError) as error:
        raise InputError(
            "file", "UTF-8 text that can be read", "something else", "Save it as UTF-8."
        ) from error


def read_header(path: Path) -> tuple[str, ...]:
    """The cells of the first line, to tell one kind of CSV file from another."""
    with existing_file(path).open(encoding="utf-8-sig", errors="replace") as file:
        line = file.readline(MAX_HEADER)
    return tuple(cell.strip() for cell in line.split(_separator(line)))


def read_csv(path: Path) -> tuple[tuple[str, ...], list[Row]]:
    """Read a CSV file with a header; blank lines are skipped.

    Where the header is separated by semicolons or tabs, as Excel does in much of Europe, so are
    the rows, and their numbers may have decimal commas.

    Returns
    -------
    header : tuple of str
    rows : list of Row

    Raises
    ------
    InputError
        When the file cannot be read, or has no header.
    """
    lines = read_text(path).splitlines()
    separator = _separator(next(filter(str.strip, lines), ""))
    reader = csv.reader(lines, delimiter=separator, strict=True)
    try:
        rows = [Row(reader.line_num, cells) for cells in reader if any(map(str.strip, cells))]
    except csv.Error as error:
        line = f"line {reader.line_num}"
        raise InputError(line, "separated cells", str(error), "Export it again.") from error
    if len(rows) < 2:
        raise InputError("file", "a header and rows", f"{len(rows)} lines", "Export it again.")
    body = rows[1:] if separator == "," else _with_points(rows[1:])
    return tuple(cell.strip() for cell in rows[0].cells), body


def _separator(header: str) -> str:
    """Whichever gives a header the most cells; the comma where two give as many."""
    return max(SEPARATORS, key=header.count)


def _with_points(rows: list[Row]) -> list[Row]:
    """Decimal points for decimal commas, unless both occur: then a comma may part thousands."""
    cells = [cell.strip() for row in rows for cell in row.cells]
    if any(map(_POINT.fullmatch, cells)):
        return rows
    return [Row(row.line, [_COMMA.sub(r"\1.\2", cell) for cell in row.cells]) for row in rows]


def check_width(rows: Sequence[Row], header: Sequence[str]) -> None:
    """Check that each row has one cell a column.

    Raises
    ------
    InputError
        Names the first line that has not.
    """
    for row in rows:
        if len(row.cells) != len(header):
            raise InputError(
                f"line {row.line}",
                f"{len(header)} cells as in the header",
                f"{len(row.cells)}",
                "Mend or remove the line.",
            )


def to_numbers(rows: Sequence[Row], header: Sequence[str], columns: Sequence[int]) -> FloatArray:
    """Turn the cells of some columns into numbers, (rows, columns); a blank cell is NaN.

    Raises
    ------
    InputError
        Names the line and the column of the first cell that is no number.
    """
    cells = [[row.cells[column].strip() or "nan" for column in columns] for row in rows]
    try:
        return np.array(cells, dtype=np.float64).reshape(len(rows), len(columns))
    except ValueError:
        raise _first_bad_cell(rows, header, columns) from None


def _first_bad_cell(
    rows: Sequence[Row], header: Sequence[str], columns: Sequence[int]
) -> InputError:
    for row in rows:
        for column in columns:
            cell = row.cells[column].strip()
            try:
                float(cell or "nan")
            except ValueError:
                where = f"line {row.line}, column {header[column]}"
                return InputError(where, "a number", repr(cell[:40]), "Mend or remove the line.")
    raise AssertionError("every cell is a number")  # pragma: no cover
