"""Columns that are the coordinates of markers, in the spellings of many programs.

``NAME.x``, ``NAME_x``, ``NAME:X``, ``NAME X (mm)``, ``NAME.tx``, ``NAME.posX``,
``NAME.Translate X``, ``NAME[x]``, ``nameX``, ``NAMEX``, ``X_0``, ``NAME_0``. Three such columns are
a marker where every column is one of three, and their values can be positions; else they are
weights.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.spelling import words
from facert.errors import InputError

log = logging.getLogger("facert")

_POSITION = r"(?:t|pos|position|trans|translate|translation|loc|location|coord)"
_UNIT = r"(?:\s*[\[(]\s*(?P<unit>mm|cm|dm|m|in|ft)\s*[\])]|_(?P<unit_>mm|cm))?"
_OWN = re.compile(r"(?P<name>.+)\.(?P<axis>[xyz])")
_PLAIN = re.compile(r"(?P<name>.+)[._](?P<axis>[xyz])", re.IGNORECASE)
_POSITIONS, *_OTHERS = (
    re.compile(pattern, flags)
    for pattern, flags in (
        (
            rf"(?P<name>.+?)[._:\s/|-]\s*{_POSITION}[._:\s-]*(?P<axis>[xyz]){_UNIT}",
            re.IGNORECASE,
        ),
        (rf"(?P<name>.+?)\s*[._:\s/|-]\s*(?P<axis>[xyz]){_UNIT}", re.IGNORECASE),
        (r"(?P<name>.+?)\s*[\[(]\s*(?P<axis>[xyz])\s*[\])]", re.IGNORECASE),
        (r"(?P<axis>[xyz])[._:\s-]?(?P<name>\d+)", re.IGNORECASE),
        (r"(?P<axis>[xyz])[._:\s-](?P<name>.+)", re.IGNORECASE),
    )
)
_GLUED = (
    re.compile(r"(?P<name>.*[^\W_A-Z])(?P<axis>[XYZ])"),
    re.compile(r"(?P<name>[^\W_a-z]{2,})(?P<axis>[XYZ])"),
    re.compile(r"(?P<name>[^\W_]{3,})(?P<axis>[xyz])"),
    re.compile(rf"(?P<name>.*[^\W_])(?P<axis>[XYZ]){_UNIT}"),
)
_NUMBERED = re.compile(r"(?P<name>.+?)[._:\s\[(-](?P<axis>[012])[\])]?")
_NUMBERS = str.maketrans("012", "xyz")
_SPELLINGS = (_OWN, _POSITIONS, _PLAIN, *_OTHERS, *_GLUED, _NUMBERED)
_ROTATIONS = {"rot", "rotation", "rotate", "angle", "euler", "quat", "quaternion", "scale"}

_ENOUGH = 10  # rows that show of what kind values are
_IN_WEIGHTS = 1.01  # values beyond are no weights, unless they are large angles
_OWN_MOTION = 0.08  # metres: no marker of a face moves so far among the others


@dataclass(frozen=True)
class Markers:
    """Markers among the columns of a table."""

    names: tuple[str, ...]
    columns: IntArray
    """Columns of x, y and z of each, (M, 3)."""
    unit: str = ""
    """That of the positions, where their names state it."""


def markers_among(names: Sequence[str], values: FloatArray, sure: bool = False) -> Markers | None:
    """The markers whose coordinates the columns (T, C) are; None where they are weights.

    `sure` is for columns that are known to be coordinates.

    Raises `InputError` for a column that is none among others that are positions.
    """
    for spelling in _SPELLINGS:
        found, unit = _triples(spelling, names)
        if not found:
            continue
        markers = Markers(tuple(found), np.array(list(found.values()), dtype=np.int64), unit)
        if markers.columns.size == len(names):
            if spelling is _NUMBERED and not sure and not _around_origin(markers, values):
                return None
            if not sure and not _are_positions(markers, values, spelling in _GLUED):
                return None
            if spelling not in (_OWN, _PLAIN) and not sure:
                log.info("markers by columns such as %r", names[markers.columns[0, 0]])
            return markers
        if spelling is _PLAIN and 2 * markers.columns.size > len(names):
            _refuse_mixture(markers, names, values)
    return None


def _triples(spelling: re.Pattern[str], names: Sequence[str]) -> tuple[dict[str, list[int]], str]:
    """Columns of x, y and z of each name that has all three in this spelling; their unit."""
    matches = [spelling.fullmatch(name) for name in names]
    place: dict[tuple[str, str], int] = {}
    units = set()
    for column, match in enumerate(matches):
        if match is not None:
            axis = match["axis"].lower().translate(_NUMBERS)
            place.setdefault((match["name"], axis), column)
            groups = match.groupdict()
            units.add((groups.get("unit") or groups.get("unit_") or "").lower())
    different = dict.fromkeys(name for name, _ in place)
    whole = [name for name in different if all((name, axis) in place for axis in "xyz")]
    unit = units.pop() if len(units) == 1 else ""
    return {name: [place[name, axis] for axis in "xyz"] for name in whole}, unit


def _are_positions(markers: Markers, values: FloatArray, glued: bool) -> bool:
    """Whether names and values can be those of markers; the log has it if not.

    Where nothing stands between name and axis, values within the range of weights are weights.
    """
    small = not (np.abs(values[:, markers.columns]) > _IN_WEIGHTS).any()
    turns = any(name.lower().endswith(tuple(_ROTATIONS)) for name in markers.names)
    if not (glued and (small or turns)) and not _like_weights(markers, values):
        return True
    log.info(
        "columns such as %s.x are weights by name or values; "
        "a first column named 'time (markers)' makes them positions",
        markers.names[0],
    )
    return False


def _around_origin(markers: Markers, values: FloatArray) -> bool:
    """Whether values lie on both sides of 0, farther than weights: numbers alone name no axes."""
    positions = values[:, markers.columns]
    return bool((positions < -_IN_WEIGHTS).any() and (positions > _IN_WEIGHTS).any())


def _like_weights(markers: Markers, values: FloatArray) -> bool:
    if any(_ROTATIONS & set(words(name)) for name in markers.names):
        return True
    positions = values[:, markers.columns]  # (T, M, 3)
    observed = positions[np.isfinite(positions)]
    if len(positions) < _ENOUGH or not len(observed) or np.abs(observed).max() > _IN_WEIGHTS:
        return False
    ends = np.isin(observed, (0.0, 1.0)).mean()
    moves = np.ptp(observed) > 0
    return bool(moves and ((observed.min() >= 0 and ends > 0.02) or _own_motion(positions)))


def _own_motion(positions: FloatArray) -> bool:
    """Whether the values (T, M, 3) move among themselves further than markers in metres can."""
    with np.errstate(invalid="ignore"):
        common = np.nan_to_num(np.nanmean(np.nan_to_num(positions), axis=1, keepdims=True))
        spread = np.nanstd(np.where(np.isnan(positions), np.nan, positions - common), axis=0)
    return bool(np.nanmedian(spread) > _OWN_MOTION)


def _refuse_mixture(markers: Markers, names: Sequence[str], values: FloatArray) -> None:
    """Refuse a column among positions that is none."""
    if _like_weights(markers, values):
        return
    inside = set(markers.columns.ravel().tolist())
    odd = next(name for column, name in enumerate(names) if column not in inside)
    expected = "markers only, each with x, y and z"
    fix = "Remove it: a take's source is markers or weights, not both."
    raise InputError(f"column {odd}", expected, "another column", fix)
