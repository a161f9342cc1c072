"""The frames of a tracker's JSON, found by their shape: named numbers and texts of each.

Frames are a list of objects, wherever it stands, one object a line, an object with a key a frame,
or columns. In each, weights are ``{name: number}``, a list of objects with a name and a score, or a
list of numbers, one a name of a list beside the frames.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from facert.data.column_names import Role, role_of_name
from facert.errors import InputError
from facert.io.lines import MAX_COLUMNS, require_few

log = logging.getLogger("facert")

Number = int | float
"""Truths are numbers as well."""

_NAME_KEYS = ("categoryName", "category_name", "name", "label", "key", "shape", "blendShape",
              "blendshape", "displayName", "display_name")  # fmt: skip
_SCORE_KEYS = ("score", "value", "weight", "coefficient", "amount")
_AXES = ("x", "y", "z")
_OF_POINTS = frozenset((*_AXES, "w", "h", "width", "height", "visibility", "presence", "score",
                        "confidence", "id", "index", *_NAME_KEYS))  # fmt: skip
_DEEPEST = 6
_CLOCKS = (Role.CLOCK, Role.FRAME)
MOST_FRAMES = 2**20
"""More than in nine hours; each is an object of its own, even where there is nothing in it."""


@dataclass
class Frame:
    """The contents of a frame."""

    plain: dict[str, Number | str] = field(default_factory=dict)
    """Numbers and texts of the frame's own."""
    groups: dict[str, dict[str, Number]] = field(default_factory=dict)
    """Named numbers under each key."""
    points: dict[str, dict[str, Number]] = field(default_factory=dict)
    """Coordinates of the points, or landmarks, in a list under each key."""
    others: set[str] = field(default_factory=set)
    """Keys of numbers without names."""


def parsed(text: str) -> Any:
    """What a JSON text holds; of a text with an object a line, the list of them.

    Raises `InputError` for any other text.
    """
    _require_few_names(text)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        many = text.count("\n") > MOST_FRAMES
        lines = [] if many else [line for line in text.splitlines() if line.strip()]
        if many and text.partition("\n")[0].rstrip().endswith(("}", "]")):
            raise _too_many(text.count("\n")) from None
        if len(lines) < 2 or not all(line.lstrip()[0] in "{[" for line in lines):
            raise InputError("file", "JSON", str(error), "Export it again.") from None
    try:
        return _documents(lines)
    except (ValueError, RecursionError) as error:
        expected = "JSON, whole or in each line"
        raise InputError("lines", expected, str(error), "Export it again.") from None


def _require_few_names(text: str) -> None:
    """Refuse a frame with very many names before it is parsed: the first object is looked at.

    One whose keys are times or numbers of frames may be a long curve.
    """
    first = text[: text.find("}") + 1]
    *named, _ = first[first.rfind("{") + 1 :].split('":', MAX_COLUMNS + 1)
    if len(named) > MAX_COLUMNS and not _is_numeral(named[-1].rpartition('"')[2]):
        require_few(first.count('":'))


def _too_many(frames: int) -> InputError:
    expected = f"at most {MOST_FRAMES} frames"
    return InputError("frames", expected, f"{frames}", "Cut it into parts.")


def _documents(lines: Sequence[str]) -> list[Any]:
    """What each line holds; a last one that was not finished is left out, and logged."""
    documents = [json.loads(line) for line in lines[:-1]]
    try:
        documents.append(json.loads(lines[-1]))
    except ValueError:
        if len(documents) < 2:
            raise
        log.warning("the last line is not finished and left out")
    return documents


def frames_of(document: Any) -> list[Frame]:
    """The frames of a document.

    Raises `InputError` when there are none, or a frame has more or fewer numbers than names.
    """
    names = _names(document)
    found = _by_key(document, names) if isinstance(document, dict) else None
    lists = [found] if found else list(_lists(document, names))
    if not lists:
        keys = ", ".join(list(document)[:6]) if isinstance(document, dict) else "no frames"
        expected = "frames of weights by name, or facsNames and weightMat"
        raise InputError("weightMat", expected, keys or "nothing", "Export it in such a layout.")
    frames = max(lists, key=len)
    if len(frames) > MOST_FRAMES:
        raise _too_many(len(frames))
    return [_frame(one, names) for one in frames[_is_header(frames) :]]


def _is_header(frames: Sequence[Any]) -> bool:
    """Whether the first object of a list is about the others: none of its keys is in theirs."""
    if len(frames) < 3 or not all(isinstance(one, dict) for one in frames[:3]):
        return False
    return not frames[0].keys() & frames[1].keys() and bool(frames[1].keys() & frames[2].keys())


def rate_of(document: Any) -> float | None:
    """The frames a second that a document states beside its frames, if it does."""
    if isinstance(document, list) and _is_header(document):
        return rate_of(document[0])
    if not isinstance(document, dict):
        return None
    for key, value in document.items():
        if key.lower().replace("_", "") in ("fps", "framerate", "exportfps", "samplingrate"):
            return float(value) if _is_number(value) and 0 < value < float("inf") else None
    inner = (rate_of(value) for value in document.values() if isinstance(value, dict))
    return next((rate for rate in inner if rate is not None), None)


def has_times(document: Mapping[str, Any]) -> bool:
    """Whether an object states no rate, but times of its frames in a list."""
    times = (role_of_name(key) in _CLOCKS and _is_column(value) for key, value in document.items())
    return rate_of(document) is None and any(times)


def _names(document: Any) -> tuple[str, ...]:
    """The longest list of texts outside of the frames: the names of their numbers."""
    if isinstance(document, list) and _is_header(document):
        document = document[0]
    lists: list[list[str]] = []
    _collect_names(document, lists, 0)
    longest: list[str] = max(lists, key=len, default=[])
    return tuple(longest)


def _collect_names(value: Any, lists: list[list[str]], depth: int) -> None:
    if not isinstance(value, dict) or depth > _DEEPEST:
        return
    for inner in value.values():
        if isinstance(inner, list) and inner and all(isinstance(one, str) for one in inner):
            lists.append(inner)
        _collect_names(inner, lists, depth + 1)


def _lists(value: Any, names: Sequence[str], depth: int = 0) -> Iterator[list[Any]]:
    """Every list that may be one of frames."""
    if depth > _DEEPEST:
        return
    if isinstance(value, list):
        if value and all(one is None or _may_be_frame(one, names) for one in value):
            yield value
    elif isinstance(value, dict):
        for inner in value.values():
            yield from _lists(inner, names, depth + 1)


def _may_be_frame(value: Any, names: Sequence[str]) -> bool:
    if isinstance(value, list):
        return not value or _pairs(value) is not None or _is_row(value, names)
    return isinstance(value, dict)


# ---- frames of other layouts than a list


def _by_key(document: Mapping[str, Any], names: Sequence[str]) -> list[Any] | None:
    """Frames of columns, of pandas' tables, of a matrix with times, or with a key a frame."""
    if isinstance(document.get("columns"), list) and isinstance(document.get("data"), list):
        rows = document["data"]
        if all(isinstance(row, list) for row in rows):
            return [dict(zip(document["columns"], row, strict=False)) for row in rows]
    objects = [value for value in document.values() if isinstance(value, dict) and value]
    if len(objects) == len(document) > 1:
        if all(map(_is_numeral, document)):
            clock = "time" if any("." in key for key in document) else "frame"
            return [{clock: float(key), **frame} for key, frame in document.items()]
        if all(objects[0].keys() == one.keys() for one in objects) and all(
            map(_is_numeral, objects[0])
        ):
            return [{key: document[key][row] for key in document} for row in objects[0]]
    return _of_matrix(document, names) or _of_columns(document)


def _of_matrix(document: Mapping[str, Any], names: Sequence[str]) -> list[Any] | None:
    """Frames of rows of numbers, one a name, beside a list of their times."""
    for rows in document.values():
        if not (isinstance(rows, list) and rows and all(_is_row(row, names) for row in rows)):
            continue
        for key, times in document.items():
            if role_of_name(key) in _CLOCKS and _is_column(times) and len(times) == len(rows):
                return [{key: t, "weights": row} for t, row in zip(times, rows, strict=True)]
    return None


def _is_row(value: Any, names: Sequence[str]) -> bool:
    """Whether a value has a number, or null, for each name."""
    if not isinstance(value, list) or not names or len(value) != len(names):
        return False
    return _are_numbers(value)


def _of_columns(document: Mapping[str, Any]) -> list[Any] | None:
    """Frames of lists of as many numbers each."""
    columns: dict[str, list[Any]] = {}
    for key, value in document.items():
        inner = value if isinstance(value, dict) else {key: value}
        columns |= {name: one for name, one in inner.items() if _is_column(one)}
    lengths = {len(column) for column in columns.values()}
    if len(columns) < 2 or len(lengths) != 1 or any(_is_objects(v) for v in document.values()):
        return None
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _is_column(value: Any) -> bool:
    plain = isinstance(value, list) and len(value) > 1
    return plain and _are_numbers(value)


def _is_objects(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(one, dict) for one in value)


def _is_numeral(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


# ---- what is in a frame


def _frame(value: Any, names: Sequence[str]) -> Frame:
    frame = Frame()
    _add(frame, "", value, names, 0)
    return frame


def _add(frame: Frame, key: str, value: Any, names: Sequence[str], depth: int) -> None:
    """Add what is under a key of a frame, or of an object in it."""
    if depth > _DEEPEST:
        return
    if isinstance(value, dict):
        _add_object(frame, key, value, names, depth)
    elif isinstance(value, list):
        _add_list(frame, key, value, names, depth)
    elif _is_number(value) or isinstance(value, str):
        frame.plain[key] = value


def _add_object(
    frame: Frame, key: str, value: Mapping[str, Any], names: Sequence[str], depth: int
) -> None:
    require_few(len(value))
    group: dict[str, Number] = {}
    for name, inner in value.items():
        named = _numbers_of(name, inner) if depth else None
        if named is None:
            _add(frame, name, inner, names, depth + 1)
        else:
            group |= named
    if depth and (group or not value):
        frame.groups.setdefault(key, {}).update(group)


def _numbers_of(name: str, value: Any) -> dict[str, Number] | None:
    """A weight, the score of one, or the coordinates of a marker in a group; None for another."""
    if _is_number(value):
        return {name: value} if role_of_name(name) is None else None
    xyz = _xyz(value)
    if xyz is not None:
        return {f"{name}.{axis}": one for axis, one in zip(_AXES, xyz, strict=True)}
    score = _score(value) if isinstance(value, dict) else None
    return None if score is None else {name: score}


def _add_list(
    frame: Frame, key: str, value: Sequence[Any], names: Sequence[str], depth: int
) -> None:
    pairs = _pairs(value)
    points = {} if value and _is_row(value[0], names) else _points(value)
    if points:
        frame.points[key] = points
    elif pairs is not None:
        frame.groups.setdefault(key, {}).update(pairs)
    elif value and _is_point(value[0]):  # in a plane, or a box
        frame.others.add(key)
    elif _are_numbers(value):
        _add_numbers(frame, key, value, names)
    elif isinstance(value[0], dict | list):  # of several faces the first
        _add(frame, key, value[0], names, depth + 1)


def _add_numbers(frame: Frame, key: str, value: Sequence[Any], names: Sequence[str]) -> None:
    """Add numbers that have their names beside the frames."""
    if len(value) == len(names) and names:
        named = zip(names, value, strict=True)
        frame.groups.setdefault(key, {}).update({n: v for n, v in named if v is not None})
    elif names and key.lower() in ("weights", "blendshapes", "values"):
        expected, found = f"{len(names)} numbers, one a name", f"{len(value)}"
        raise InputError(key, expected, found, "Export it again.")
    elif value:
        frame.others.add(key)


def _points(value: Sequence[Any]) -> dict[str, Number]:
    """Coordinates of points in space, named as they are or else by number; empty for others."""
    points: dict[str, Number] = {}
    for number, one in enumerate(value):
        xyz = _xyz(one)
        if xyz is None:
            return {}
        names = (one[key] for key in _NAME_KEYS if key in one) if isinstance(one, dict) else ()
        name = next((name for name in names if isinstance(name, str) and name), str(number))
        points |= {f"{name}.{axis}": place for axis, place in zip(_AXES, xyz, strict=True)}
    return points if len(points) == len(_AXES) * len(value) else {}


def _is_point(value: Any) -> bool:
    return isinstance(value, dict) and {"x", "y"} <= value.keys() <= _OF_POINTS


def _xyz(value: Any) -> Sequence[Number] | None:
    """The coordinates of ``{x, y, z}``, with a name or confidence or not, or of ``[x, y, z]``."""
    if _is_point(value):
        value = [value.get(axis) for axis in _AXES]
    whole = isinstance(value, list) and len(value) == len(_AXES)
    return value if whole and all(map(_is_number, value)) else None


def _pairs(value: Sequence[Any]) -> dict[str, Number] | None:
    """Numbers by name of a list in which each has both; None for another list."""
    pairs = {}
    for one in value:
        name, score = _pair(one)
        if name is None or score is None or name in pairs:
            return None
        pairs[name] = score
    return pairs


def _pair(value: Any) -> tuple[str | None, Number | None]:
    """Name and number of an object with both, ``[name, number]`` or ``{name: number}``."""
    if isinstance(value, list) and len(value) == 2:
        value = {"name": value[0], "score": value[1]}
    if not isinstance(value, dict):
        return None, None
    if len(value) == 1:
        ((name, score),) = value.items()
        return name, score if _is_number(score) else None
    texts = (value[key] for key in _NAME_KEYS if isinstance(value.get(key), str))
    return next(filter(None, texts), None), _score(value)


def _score(value: Mapping[str, Any]) -> Number | None:
    return next((value[key] for key in _SCORE_KEYS if _is_number(value.get(key))), None)


def _are_numbers(values: Sequence[Any]) -> bool:
    """Whether each is a number, or null."""
    return set(map(type, values)) <= {int, float, bool, type(None)}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)
