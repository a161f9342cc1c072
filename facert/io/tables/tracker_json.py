"""Takes out of the JSON of trackers, in whatever layout; see `facert.io.tables.json_frames`.

Beside the weights a frame may have its time, its number or a flag; what else is in it is left out,
and the log names it. Curves as Audio2Face writes them are read by `facert.io.curves`.
"""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.column_names import names_face, role_of_name
from facert.data.columns import learnable
from facert.data.memory import FileMemory
from facert.data.take import Take
from facert.data.text import listed, plural
from facert.errors import InputError, reading
from facert.io.curves import holds_curves, take_of_curves
from facert.io.guarded import read_text
from facert.io.lines import require_few
from facert.io.tables.curve_table import is_json_curve_table, take_of_json_curves
from facert.io.tables.json_frames import Frame, Number, frames_of, has_times, parsed, rate_of
from facert.io.tables.table import Table
from facert.io.tables.table_take import Reading, take_of_table

log = logging.getLogger("facert")

# Of a head, an eye or a box around the face.
_AXES = frozenset(("x", "y", "z", "w", "h", "width", "height", "pitch", "yaw", "roll",
                   "rx", "ry", "rz"))  # fmt: skip
_OWN = re.compile(
    r'\{("createdBy": "[^"]*", )?"exportFps": [^,]*, "trackPath": "", "startTimecode": '
)
_LARGE, _SPARSE = 2**20, 20  # cells; of such a table one in so many must be filled


def read_json_take(
    path: Path, fps: float | None = None, keep: Sequence[str] = (), sparse: bool = False
) -> Take:
    """Read a JSON file as a take whose source is weights, or markers.

    `fps` is for a file that states neither times nor a rate; `sparse` frames are poses of single
    ones, far apart. What is a clock, a counter or a flag is left out, unless it is in `keep`, or
    facert wrote the file.

    Raises `InputError` naming the file and the key or frame that is at fault.
    """
    with reading(path):
        text = read_text(path)
        document = parsed(text)
        if _are_curves(document):
            take = take_of_curves(document, fps)
            return take if _OWN.match(text) else learnable(take, keep, sparse)
        if is_json_curve_table(document):
            return take_of_json_curves(document, FileMemory(path))
        table = _table(_or_points(frames_of(document)))
        return take_of_table(table, Reading(rate_of(document) or fps, tuple(keep), sparse))


def read_json_table(path: Path) -> Table | None:
    """The frames of a JSON file as a table; None where it holds curves.

    Raises `InputError` as `read_json_take` does.
    """
    with reading(path):
        document = parsed(read_text(path))
        return None if _are_curves(document) else _table(_or_points(frames_of(document)))


def _are_curves(document: Any) -> bool:
    return isinstance(document, dict) and holds_curves(document) and not has_times(document)


def _or_points(frames: Sequence[Frame]) -> Sequence[Frame]:
    """The frames with the points of their longest list as markers, where they have no weights."""
    count = Counter({key: len(points) for frame in frames for key, points in frame.points.items()})
    groups = (group for frame in frames for group in frame.groups.values())
    plain = any(_is_weight(*one) for frame in frames for one in frame.plain.items())
    if not count or plain or any(not names.keys() <= _AXES for names in groups):
        return [replace(frame, others=frame.others | frame.points.keys()) for frame in frames]
    key = count.most_common(1)[0][0]
    return [_of_points(frame, key) for frame in frames]


def _of_points(frame: Frame, key: str) -> Frame:
    """A frame whose points under a key are its markers."""
    others = frame.others | (frame.groups.keys() | frame.points.keys()) - {key}
    plain = {name: value for name, value in frame.plain.items() if name not in _AXES}
    return Frame(plain, {key: frame.points.get(key, {})}, others=others)


def _table(frames: Sequence[Frame]) -> Table:
    """The frames as a table: what is no weight in front, then the weights."""
    require_few(max(map(_size, frames), default=0))
    columns = _columns(frames, _weights(frames))
    rows: list[dict[str, Number | str]] = []
    taken = frozenset(columns.values())
    for frame in frames:
        row = {name: value for name, value in frame.plain.items() if _is_read(name, taken)}
        for key, group in frame.groups.items():
            row.update({columns[key, n]: v for n, v in group.items() if (key, n) in columns})
        rows.append(row)
    names = tuple(dict.fromkeys(name for row in rows for name in row))
    cells = len(names) * len(rows)
    if cells > max(_LARGE, _SPARSE * sum(map(len, rows))):
        expected = "frames that have the same names"
        raise InputError("frames", expected, f"{len(names)} names in all", "Export it again.")
    numbers = np.full((len(rows), len(names)), np.nan)
    texts: dict[int, Sequence[str]] = {}
    for column, name in enumerate(names):
        found = _numbers([row.get(name) for row in rows])
        if found is None:
            texts[column] = [str(row.get(name, "")) for row in rows]
        else:
            numbers[:, column] = found
    return Table(names, numbers, texts, lambda row: f"frame {row + 1}")


def _size(frame: Frame) -> int:
    return len(frame.plain) + sum(map(len, frame.groups.values()))


def _columns(frames: Sequence[Frame], groups: Sequence[str]) -> dict[tuple[str, str], str]:
    """A column for each name under each key; the key stands before a name that is there twice."""
    columns: dict[tuple[str, str], str] = {}
    taken: set[str] = set()
    for key in groups:
        names = dict.fromkeys(name for frame in frames for name in frame.groups.get(key, {}))
        for name in names:
            columns[key, name] = f"{key}.{name}" if name in taken else name
        taken |= set(names)
    return columns


def _weights(frames: Sequence[Frame]) -> list[str]:
    """The keys of groups that are weights, the largest first; none where frames are plain."""
    counts, of_face = Counter[str](), Counter[str]()
    for frame in frames:
        for key, group in frame.groups.items():
            counts[key] += len(group)
            of_face[key] += len(group.keys() - _AXES)
    plain = sum(_is_weight(name, value) for frame in frames for name, value in frame.plain.items())
    filled = [key for key, count in counts.items() if count]
    ranked = sorted(filled, key=lambda key: (of_face[key], counts[key]), reverse=True)
    main = ranked[:1] if ranked and counts[ranked[0]] > plain else []
    facial = [key for key in ranked if key not in main and _is_of_face(key, frames)]
    used = main + facial
    empty = sum(not any(map(frame.groups.get, used)) for frame in frames) if used else 0
    if empty:
        text = "%s without a face (no %s): not observed"
        log.info(text, plural(empty, "frame"), listed(list(map(repr, used))))
    unused = {key for frame in frames for key in frame.others} | set(filled)
    left_out = unused - set(used)
    if left_out:
        log.info("left out, as no weights: %s", listed(sorted(map(repr, left_out))))
    return used


def _is_weight(name: str, value: Number | str) -> bool:
    return not isinstance(value, str) and role_of_name(name) is None and name not in _AXES


def _is_of_face(key: str, frames: Sequence[Frame]) -> bool:
    """Whether all numbers of a group have names of a face, other than angles and places."""
    names = {name for frame in frames for name in frame.groups.get(key, {})}
    return bool(names) and not names & _AXES and all(map(names_face, names))


def _is_read(name: str, columns: Set[str]) -> bool:
    """Whether a frame's own number is used: beside groups of weights only what is known."""
    known = role_of_name(name) is not None or names_face(name)
    return not columns or (known and name not in columns)


def _numbers(cells: Sequence[Number | str | None]) -> FloatArray | None:
    """A column of numbers, of those that are texts as well; None for one of texts."""
    try:
        return np.array([np.nan if cell is None else float(cell) for cell in cells])
    except (ValueError, OverflowError):
        return None
