"""Columns beside the weights of a table: found by name and by shape, used or left out, and logged.

A model that learns from a clock or a counter among its weights takes every frame for a new
expression. Whatever reads a foreign table asks here which of its columns are weights.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.column_names import Role, is_letter, name_words, names_face, role_of_name
from facert.data.names import fitting
from facert.data.take import Source, Take
from facert.data.text import listed, plural
from facert.errors import InputError

log = logging.getLogger("facert")

ENOUGH = 10
"""Fewest rows that show a shape: a clock, a counter or a flag."""

_WEIGHTS = 1.5  # within this range a clock looks like a ramp of a weight
_HUGE = 1e150  # whose square is a number still
_BEYOND = 1e5
_LINEAR = 1e-2  # of the range, by which a clock strays from a line
_FEW = 4  # rows that copy the frames' numbers exactly
_TWO_VALUED = 2  # more columns of two values than this are weights: lips of a puppet, visemes
_LISTED = 12
# Words of what says nothing of a face when it is 0, and of a picture's size.
_VAGUE = frozenset(("status", "state", "done", "checked", "approved", "reviewed", "note", "notes",
                    "comment", "comments", "remark", "remarks"))  # fmt: skip
_SIZES = frozenset(("width", "height", "size", "image", "img", "frame", "video", "camera",
                    "resolution", "w", "h", "x", "y", "px"))  # fmt: skip
# Seconds, frames at the usual rates and smaller units, a second or a frame.
_RATES = np.array((24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 120.0))
_SLOPES = np.concatenate([10.0 ** np.arange(-9, 10, 3), _RATES, 1 / _RATES, 1e3 / _RATES])


@dataclass(frozen=True)
class Weights:
    """What of a table's columns is learned from."""

    columns: IntArray
    """Indices of the columns that are weights."""
    absent: BoolArray
    """Rows in which a flag states that there was no face, (T,)."""


def weight_columns(
    names: Sequence[str],
    values: FloatArray,
    time: FloatArray,
    keep: Sequence[str] = (),
    coordinates: Sequence[int] = (),
    sparse: bool = False,
) -> Weights:
    """The weights among the columns of a table, and the rows without a face; the log has the rest.

    Parameters
    ----------
    names : sequence of str, length D
    values : array, shape (T, D)
    time : array, shape (T,)
        Seconds of the rows.
    keep : sequence of str
        Names, in any spelling or with wildcards, of columns that are weights whatever they look
        like.
    coordinates : sequence of int
        Columns that are those of markers.
    sparse : bool
        The rows are single frames, of whose poses many have two values or rise steadily.

    Raises `InputError` when no column is a weight.
    """
    kept = {*coordinates, *(column for pattern in keep for column in fitting(pattern, names))}
    roles = {
        column: role
        for column, role in roles_of(names, values, time, sparse).items()
        if column not in kept
    }
    if names and len(roles) == len(names):
        found, fix = ", ".join(names), "Add weights; facert convert --keep NAME keeps a column."
        raise InputError("columns", "a weight at least", found, fix)
    _log_left_out(names, roles)
    absent = _absent(names, values, roles)
    left = [column for column in range(len(names)) if column not in roles]
    return Weights(np.array(left, dtype=np.int64), absent)


def roles_of(
    names: Sequence[str], values: FloatArray, time: FloatArray, sparse: bool = False
) -> dict[int, Role]:
    """The columns (T, D) that are no weights, by name or else by shape; see `weight_columns`."""
    values = np.clip(values, -_HUGE, _HUGE)  # shapes are judged by differences and their squares
    named = {column: role_of_name(name) for column, name in enumerate(names)}
    roles = {
        column: role
        for column, role in named.items()
        if role is not None and (not is_letter(names[column]) or rises(values[:, column]))
    }
    nameless = [c for c, name in enumerate(names) if c not in roles and not names_face(name)]
    sizes = [column for column in nameless if _is_size(names[column], values[:, column])]
    roles |= dict.fromkeys(sizes, Role.SIZE)
    nameless = [column for column in nameless if column not in roles]
    if sparse:
        copies = (c for c in nameless if _restates(values[:, c], time))
        return roles | dict.fromkeys(copies, Role.CLOCK)
    shaped = {column: _role_of_shape(values[:, column], time) for column in nameless}
    flags = [c for c in nameless if len(names[c]) > 1 and _is_two_valued(values[:, c])]
    roles |= {column: role for column, role in shaped.items() if role is not None}
    return roles | (dict.fromkeys(flags, Role.FLAG) if len(flags) <= _TWO_VALUED else {})


def _is_size(name: str, column: FloatArray) -> bool:
    """Whether a column is the width or height of a picture: by name, constant, and no weight."""
    found = {*name_words(name)}
    named = bool(found & {"width", "height", "size", "resolution"}) and found <= _SIZES
    return named and bool((column == column[0]).all() and column[0] > _WEIGHTS)


def rises(column: FloatArray) -> bool:
    """Whether a column (T,) is observed everywhere, and each value is above the one before."""
    return bool(np.isfinite(column).all() and (np.diff(column) > 0).all())


def _role_of_shape(column: FloatArray, time: FloatArray) -> Role | None:
    """A clock or a counter, if a column rises as one: beyond the range of weights, and steadily."""
    observed = np.isfinite(column)
    column, time = column[observed], time[observed]
    if len(column) < ENOUGH:
        return None
    if not (np.diff(column) > 0).all():
        return Role.COUNTER if _wraps(column) else None
    span = column[-1] - column[0]
    if span <= _WEIGHTS:
        return None
    if np.abs(column).min() > _BEYOND:
        return Role.CLOCK
    if (column == np.rint(column)).all():
        steps = np.diff(column)
        return Role.COUNTER if np.ptp(steps) == 0 or _is_line(column, time) else None
    rows = np.arange(len(column), dtype=np.float64)
    return Role.CLOCK if _is_line(column, time) or _is_line(column, rows) else None


def _wraps(column: FloatArray) -> bool:
    """Whether a column (T,) counts by one, over and over: to 9, or the frames of a second."""
    count = np.ptp(column) + 1
    return bool(count > 3 and (np.diff(column) % count == 1).all())


def _is_line(column: FloatArray, time: FloatArray, most: float = _LINEAR) -> bool:
    """Whether a column (T,) is linear in time, to a part of its range."""
    centred = time - time.mean()
    total = float(centred @ centred)
    if total == 0.0:
        return False
    level = column.mean()
    slope = float(centred @ (column - level)) / total
    strays = np.abs(column - level - slope * centred).max()
    return bool(strays <= most * np.ptp(column))


def _is_two_valued(column: FloatArray) -> bool:
    observed = column[np.isfinite(column)]
    both = (observed == 0.0).any() and (observed == 1.0).any()
    return bool(len(observed) >= ENOUGH and both and np.isin(observed, (0.0, 1.0)).all())


def _log_left_out(names: Sequence[str], roles: dict[int, Role]) -> None:
    if not roles:
        return
    columns = [f"{names[column]!r} ({role.value})" for column, role in roles.items()]
    text = "left out, as no weights: %s; facert convert --keep NAME keeps one"
    log.info(text, listed(columns, _LISTED))


def _absent(names: Sequence[str], values: FloatArray, roles: dict[int, Role]) -> BoolArray:
    """Rows (T,) in which a flag states that there was no face."""
    absent = np.zeros(len(values), dtype=np.bool_)
    for column, role in roles.items():
        here = _rows_without(values[:, column], role)
        if not _states_absence(names[column], role) or not here.any():
            continue
        if here.all():
            text = "no face in any row, by %r: taken for a flag that is not kept, all rows are read"
            log.warning(text, names[column])
        elif more := int((here & ~absent).sum()):
            text = "%s without a face by %r: not observed"
            log.info(text, plural(more, "row"), names[column])
            absent |= here
    return absent


def _states_absence(name: str, role: Role) -> bool:
    """Whether 0 of a flag or confidence of this name is known to mean that there was no face."""
    found = {*name_words(name)}
    if role is Role.CONFIDENCE:
        return bool(found & {"confidence", "conf", "probability"})
    vague = bool(found & _VAGUE) and not found & {"tracking", "tracked"}
    return role_of_name(name) is role and not vague


def _rows_without(column: FloatArray, role: Role) -> BoolArray:
    """Rows in which a flag or a confidence is at its lowest: no face at all."""
    observed = column[np.isfinite(column)]
    if role is Role.ABSENCE:
        return (
            np.asarray(column == 1.0) if np.isin(observed, (0.0, 1.0)).all() else column != column
        )
    counts = role is Role.FLAG and bool((observed == np.rint(observed)).all())
    if counts or role is Role.CONFIDENCE:
        return np.asarray(column == 0.0)
    return np.zeros(len(column), dtype=np.bool_)


def learnable(take: Take, keep: Sequence[str] = (), sparse: bool = False) -> Take:
    """A foreign take with its weights alone: see `weight_columns`. One of markers is as it was.

    Raises `InputError` when no weight remains.
    """
    source = take.source
    if source.kind == "markers":
        return take
    found = weight_columns(source.names, source.values, take.time, keep, sparse=sparse)
    if len(found.columns) == len(source.names) and not found.absent.any():
        return take
    values = source.values[:, found.columns].copy()
    values[found.absent] = np.nan
    return replace(take, source=Source(values, tuple(source.names[c] for c in found.columns)))


def require_there(keep: Sequence[str], names: Sequence[str]) -> None:
    """Refuse to keep a column that is not there."""
    for pattern in keep:
        if not pattern.strip():
            fix = "Give a column without a name one in the table."
            raise InputError("--keep", "the name of a column", "an empty one", fix)
        if not fitting(pattern, names):
            found = f"no such column among {len(names)}"
            raise InputError("--keep", f"the column {pattern!r}", found, "Correct the name.")


def warn_of_clocks(take: Take) -> None:
    """Warn of weights and controls to learn from that are a clock or the like.

    That is by name, by shape, or because they copy time exactly, whatever their range.
    """
    found: dict[str, Role] = {}
    if take.source.kind == "weights":
        names, values = take.source.names, take.source.values
        roles = roles_of(names, values, take.time)
        left = (c for c, name in enumerate(names) if c not in roles and not names_face(name))
        copies = [c for c in left if _copies(values[:, c], take.time)]
        found |= {names[c]: role for c, role in (roles | dict.fromkeys(copies, Role.CLOCK)).items()}
    if take.controls is not None and take.params is not None:
        names, labels = take.controls.names, take.labels
        roles = roles_of(names, take.params[labels], take.time[labels], sparse=True)
        found |= {names[column]: role for column, role in roles.items()}
    if found:
        text = ", ".join(f"{name!r} ({role.value})" for name, role in found.items())
        log.warning("learned from, though by name or shape no weights: %s", text)


def _copies(column: FloatArray, time: FloatArray, rows: int = ENOUGH) -> bool:
    """Whether so many rows of a column are a ramp that copies time exactly, whatever its range."""
    whole = len(column) >= rows and bool(np.isfinite(column).all())
    return whole and bool(np.ptp(column) > 0) and _is_line(column, time, most=1e-6)


def _restates(column: FloatArray, time: FloatArray) -> bool:
    """Whether a column of a few rows is their time or frame in another unit or at a usual rate."""
    if not _copies(column, time, _FEW) or np.ptp(column) <= _WEIGHTS:
        return False
    slope = (column[-1] - column[0]) / (time[-1] - time[0])
    return bool((np.abs(slope / _SLOPES - 1) < 1e-4).any())
