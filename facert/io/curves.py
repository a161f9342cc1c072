"""Curves in JSON: weights over time, in the layout of NVIDIA's Audio2Face and its importers.

=================  ======================  ====================================================
``exportFps``      number                  frames a second; also read: ``fps``
``facsNames``      P names                 also read: ``names``, ``blendShapeNames``
``weightMat``      T rows of P numbers     null: not known; also read: ``weights``
``time``           T seconds, optional     without it, frames are evenly spaced
``numPoses``       P, optional             checked, as ``numFrames``, T
``startTimecode``  text, optional          of the first frame
``trackPath``      text, optional          the sound; passed over, and written empty
``createdBy``      text, optional          passed over; written first: facert's mark
=================  ======================  ====================================================
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.clock import put_together
from facert.data.rate import standard_rate
from facert.data.take import Source, Take, named_curves
from facert.data.version import CREATED_BY, MARK
from facert.errors import InputError, reading
from facert.io.atomic import write_text
from facert.io.guarded import read_beginning, read_text

_NAMES = ("facsNames", "names", "blendShapeNames")
_VALUES = ("weightMat", "weights")
_RATES = ("exportFps", "fps")
# Of curves and a pose the first key; of an evaluation a key of its settings, which come first.
_MARK = re.compile(
    rf'\s*\{{\s*(?:"settings"\s*:\s*\{{[^{{}}]*)?"created_?by"\s*:\s*"{MARK}'.encode(),
    re.IGNORECASE,
)
_BEGINNING = 2**16  # bytes that have the settings


def read_curves(path: Path, fps: float | None = None) -> Take:
    """Read curves as a take whose source is weights; `fps` is for a file that does not state it.

    Raises `InputError` naming the file and the key that is at fault.
    """
    with reading(path):
        return take_of_curves(read_json_object(path), fps)


def holds_curves(document: Mapping[str, Any]) -> bool:
    """Whether an object has a matrix of weights, as curves have."""
    return any(not isinstance(document.get(key, {}), dict) for key in _VALUES)


def take_of_curves(document: Mapping[str, Any], fps: float | None = None) -> Take:
    """The take that an object of curves is; see `read_curves`."""
    names = _names(document)
    values = _matrix(_first(document, _VALUES, "weights, a row a frame"), len(names))
    _check_count(document, "numPoses", len(names))
    _check_count(document, "numFrames", len(values))
    rate = _rate(document, fps)
    time = np.arange(len(values)) / rate
    if "time" in document:
        time = _numbers(document["time"], "time")
        time = put_together(time, values) if time.shape == (len(values),) else time
    return Take(
        time=time,
        source=Source(values, names),
        fps=rate,
        start_timecode=_text(document, "startTimecode"),
    )


def write_curves(take: Take, path: Path, overwrite: bool = False) -> None:
    """Write the poses of a take, or else its source weights; numbers as exact as float64 has them.

    Raises `InputError` when the take has markers and no poses, and `OutputExistsError` when `path`
    exists and `overwrite` is not set.
    """
    with reading(path):
        names, values = named_curves(take)
    rows = [[None if value != value else value for value in row] for row in values.tolist()]
    document = {
        "createdBy": CREATED_BY,
        "exportFps": take.fps,
        "trackPath": "",
        "startTimecode": take.start_timecode,
        "numPoses": len(names),
        "numFrames": len(rows),
        "facsNames": list(names),
        "time": take.time.tolist(),
        "weightMat": rows,
    }
    write_text(json.dumps(document, allow_nan=False), path, overwrite)


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a JSON file: curves, a pose or an evaluation."""
    return _MARK.match(read_beginning(path, _BEGINNING)) is not None


def read_json_object(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises `InputError` when the file is missing, too large, not JSON, or holds something else.
    """
    return parse_json_object(read_text(path))


def parse_json_object(text: str | bytes) -> dict[str, Any]:
    """The object that a JSON text is; see `read_json_object`."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError("file", "JSON", str(error), "Export it again.") from None
    if not isinstance(document, dict):
        found = type(document).__name__
        raise InputError("file", "a JSON object", found, "Export it again.")
    return document


def _first(document: Mapping[str, Any], keys: tuple[str, ...], what: str) -> Any:
    for key in keys:
        if key in document:
            return document[key]
    there = ", ".join(list(document)[:6]) or "nothing"
    raise InputError(keys[0], what, there, "Give Audio2Face curves, or write them with facert.")


def _names(document: Mapping[str, Any]) -> tuple[str, ...]:
    names = _first(document, _NAMES, "a list of names")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(_NAMES[0], "a list of names", repr(names)[:40], "Export it again.")
    return tuple(names)


def _matrix(rows: Any, width: int) -> FloatArray:
    values = _numbers(rows, _VALUES[0])
    if values.ndim != 2 or values.shape[1] != width:
        expected = f"rows of {width} numbers, one a name"
        raise InputError(_VALUES[0], expected, f"shape {values.shape}", "Export it again.")
    return values


def _numbers(value: Any, field: str) -> FloatArray:
    """An array of numbers; null is NaN."""
    try:
        plain = np.array(value, dtype=object)
        if not all(one is None or type(one) in (int, float) for one in plain.flat):
            raise ValueError
        return plain.astype(np.float64)  # None becomes NaN
    except (ValueError, TypeError, OverflowError):
        raise InputError(
            field, "numbers in rows of equal length", "something else", "Export it again."
        ) from None


def _check_count(document: Mapping[str, Any], key: str, count: int) -> None:
    if document.get(key, count) != count:
        raise InputError(key, f"{count} as there are", f"{document[key]!r}", "Export it again.")


def _rate(document: Mapping[str, Any], fps: float | None) -> float:
    """The rate that the file states, else `fps`."""
    rate = next((document[key] for key in _RATES if key in document), fps)
    if not isinstance(rate, (int, float)) or not 0 < rate < float("inf"):
        found = "none" if rate is None else repr(rate)
        raise InputError(
            _RATES[0], "the frames' rate", found, "Write it, or run facert convert with --in-fps."
        )
    return standard_rate(rate)


def _text(document: Mapping[str, Any], key: str) -> str:
    found = document.get(key, "")
    if not isinstance(found, str):
        raise InputError(key, "text", repr(found)[:40], "Export it again.")
    return found
