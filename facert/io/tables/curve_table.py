"""Curve Tables of Unreal Engine, both ways: rows are curves, columns are times in seconds.

In CSV the first cell is anybody's; facert's name there is its mark. Every cell holds a number, as
Unreal takes a blank for 0. In JSON, a list with an object a curve, a gap is a key that is not
there, and the blank before the first colon is facert's mark.

Unreal drops blanks, commas and quotes from the names, takes capitals for small letters, holds
times in single precision, and refuses a row whose name or time it has already.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.memory import FileMemory
from facert.data.rate import nominal_rate
from facert.data.take import Source, Take, named_curves
from facert.data.text import for_csv, from_csv
from facert.data.version import CREATED_BY, MARK
from facert.errors import InputError
from facert.io.atomic import write_text
from facert.io.guarded import read_beginning
from facert.io.lines import check_width, parse_csv, to_numbers

_DROPPED = re.compile("[\"' ,\n\r\t]")
_NAME = "Name"
_CELL = 16  # bytes of a number among all curves at all times, in a list and in an array
_TIME = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_MARK = re.compile(rf'{MARK}\d[^,\n]*,|\[\{{"{_NAME}" : '.encode())


def write_curve_table(take: Take, path: Path, overwrite: bool = False) -> None:
    """Write the poses of a take, or else its source weights, as CSV or JSON by the name's ending.

    Raises `InputError` for markers, for names or times that Unreal takes for one, and for a gap in
    CSV; `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    names, values = named_curves(take)
    _require_names(names)
    time = [f"{second:.9g}" for second in take.time]
    if len(np.unique(take.time.astype(np.float32))) < len(time):
        fix = "Write fewer frames: facert convert --fps 30."
        raise InputError("/time", "times apart in single precision", "two that are one", fix)
    is_json = path.suffix.lower() == ".json"
    text = _json(names, time, values) if is_json else _csv(names, time, values)
    write_text(text, path, overwrite)


def is_curve_table(header: Sequence[str]) -> bool:
    """Whether a CSV file with this header is a Curve Table of Unreal's or facert's."""
    return header[0] == "---" or re.match(rf"{MARK}\d", header[0]) is not None


def is_json_curve_table(document: Any) -> bool:
    """Whether a JSON file with this content is a Curve Table."""
    return (
        isinstance(document, list)
        and bool(document)
        and all(isinstance(row, dict) and isinstance(row.get(_NAME), str) for row in document)
        and all(_TIME.fullmatch(key) for row in document for key in row if key != _NAME)
    )


def read_csv_curves(text: str) -> Take:
    """The take of weights that a Curve Table in CSV is.

    Raises `InputError` naming the row or cell that is at fault.
    """
    header, rows = parse_csv(text, ",")
    check_width(rows, header)
    try:
        time = np.array([float(cell) for cell in header[1:]])
    except ValueError:
        found, fix = ", ".join(header[1:4]), "Write a row a curve, and a column a time."
        raise InputError("header", "times in seconds", found, fix) from None
    values = to_numbers(rows, header, range(1, len(header)))
    return _take(tuple(from_csv(row.cells[0]) for row in rows), time, values.T)


def take_of_json_curves(rows: Sequence[Mapping[str, Any]], memory: FileMemory) -> Take:
    """The take of weights that a Curve Table in JSON is.

    Raises `InputError` for a value that is no number, or when all curves at all times would take
    more than the memory of the file.
    """
    curves = [{float(key): row[key] for key in row if key != _NAME} for row in rows]
    time = sorted({when for curve in curves for when in curve})
    memory.require(_CELL * len(time) * len(curves), "curves")
    values = [[curve.get(when, np.nan) for curve in curves] for when in time]
    odd = next((v for row in values for v in row if isinstance(v, bool | str | list | dict)), None)
    if odd is not None:
        raise InputError("values", "a number at each time", repr(odd)[:40], "Export it again.")
    names = tuple(str(row[_NAME]) for row in rows)
    numbers = np.array(values, dtype=np.float64).reshape(len(time), len(names))
    return _take(names, np.array(time), numbers)


def _take(names: tuple[str, ...], time: FloatArray, values: FloatArray) -> Take:
    order = np.argsort(time)
    return Take(time[order], Source(values[order], names), fps=nominal_rate(time[order]))


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a Curve Table."""
    return _MARK.match(read_beginning(path)) is not None


def _require_names(names: tuple[str, ...]) -> None:
    """Refuse names that are none to Unreal, or one."""
    there: dict[str, str] = {}
    for name in names:
        plain = _DROPPED.sub("", name).casefold()
        other = there.setdefault(plain, name)
        if plain in ("", "none") or other is not name:
            found = repr(name) if other is name else f"{other!r} and {name!r}"
            fix = "Rename it: facert convert --map."
            raise InputError("names", "names that differ in Unreal", found, fix)


def _csv(names: tuple[str, ...], time: list[str], values: FloatArray) -> str:
    gaps = np.argwhere(np.isnan(values))
    if len(gaps):
        frame, column = gaps[0]
        found = f"none for {names[column]!r} in frame {frame}"
        fix = "Write a .curvetable.json, or fill the gaps: facert clean."
        raise InputError("values", "a number in every frame", found, fix)
    rows = [[CREATED_BY, *time]]
    for name, row in zip(names, values.T, strict=True):
        rows.append([for_csv(name), *(f"{value:.9g}" for value in row)])
    return "".join(",".join(row) + "\r\n" for row in rows)


def _json(names: tuple[str, ...], time: list[str], values: FloatArray) -> str:
    known = [dict(zip(time, row, strict=True)) for row in values.T.tolist()]
    curves = [{when: v for when, v in row.items() if v == v} for row in known]
    rows = [{_NAME: name, **curve} for name, curve in zip(names, curves, strict=True)]
    return json.dumps(rows).replace(f'"{_NAME}": ', f'"{_NAME}" : ', 1).replace("}, {", "},\n{")
