"""A take out of a table: its clock, its weights or markers, and rows without a face."""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from facert.data.affixes import without_affix
from facert.data.arrays import FloatArray, IntArray
from facert.data.clock import rising
from facert.data.column_names import Role, role_of_name
from facert.data.columns import Weights, require_there, weight_columns
from facert.data.names import ARKIT_NAMES, canonical, fitting
from facert.data.rate import nominal_rate
from facert.data.take import Source, Take
from facert.data.text import listed, plural
from facert.errors import InputError
from facert.io.tables.clock_column import Clock, clock_of
from facert.io.tables.coordinates import Markers, markers_among
from facert.io.tables.table import Table

log = logging.getLogger("facert")

_UNIT = re.compile(r"AU\d\d_r")
_FEWEST_UNITS = 3
_FEWEST_SHAPES = 10
_FEW = 0.1  # of the rows, which a clock may repeat


@dataclass(frozen=True)
class Reading:
    """How a table is to be read."""

    fps: float | None = None
    """Rate of a table that has no clock but frames."""
    keep: tuple[str, ...] = ()
    """Columns that are weights, whatever they look like."""
    sparse: bool = False
    """Rows are poses of single frames, and never markers."""


def take_of_table(table: Table, how: Reading) -> Take:
    """The take that a table is.

    Raises `InputError` without a clock, for a cell in it that is no time, or a column to keep that
    is not there.
    """
    require_there(how.keep, table.names)
    table = _one_subject(table)
    clock = clock_of(table, how.fps, how.sparse)
    table, clock = _without_repeats(table, clock)
    columns = _columns(table, clock.column, how.keep)
    names, values = [table.names[column] for column in columns], table.numbers[:, columns]
    markers = None if how.sparse else _markers(names, values, how.keep)
    inside = () if markers is None else markers.columns.ravel().tolist()
    found = weight_columns(names, values, clock.time, how.keep, inside, how.sparse)
    source = _source(names, values, found, markers)
    return Take(
        time=clock.time,
        source=source,
        fps=clock.rate,
        units="" if markers is None else markers.unit,
        start_timecode=clock.start_timecode,
        clock_start=clock.origin,
    )


def controls_of(
    table: Table, frames: int, keep: Sequence[str]
) -> tuple[tuple[str, ...], FloatArray]:
    """Names and values (n, P) of the controls in a table of poses; `frames` is no such column."""
    columns = _columns(table, frames, keep)
    names, values = [table.names[column] for column in columns], table.numbers[:, columns].copy()
    found = weight_columns(names, values, table.numbers[:, frames], keep, sparse=True)
    values[found.absent] = np.nan
    return tuple(names[c] for c in found.columns), values[:, found.columns]


@contextmanager
def unlogged() -> Iterator[None]:
    """Reads without a word in the log, as to see how a table would be read."""
    before, log.disabled = log.disabled, True
    try:
        yield
    finally:
        log.disabled = before


def _source(
    names: Sequence[str], values: FloatArray, found: Weights, markers: Markers | None
) -> Source:
    values = values.copy()
    values[found.absent] = np.nan
    if markers is not None:
        return Source(values[:, markers.columns], markers.names)
    return Source(values[:, found.columns], arkit_names([names[c] for c in found.columns]))


def _markers(names: Sequence[str], values: FloatArray, keep: Sequence[str]) -> Markers | None:
    """The markers of a table, when all of its columns that are not of another kind are theirs."""
    kept = {column for pattern in keep for column in fitting(pattern, names)}
    left = [c for c, name in enumerate(names) if c in kept or role_of_name(name) is None]
    found = markers_among([names[column] for column in left], values[:, left])
    if found is None:
        return None
    return Markers(found.names, np.array(left, dtype=np.int64)[found.columns], found.unit)


def _columns(table: Table, clock: int | None, keep: Sequence[str]) -> IntArray:
    """The columns that may be weights or coordinates; the log has those of text."""
    kept = {column for pattern in keep for column in fitting(pattern, table.names)}
    blank = np.asarray(np.isnan(table.numbers).all(axis=0))
    texts = [column for column in table.texts if column != clock]
    numbers = [
        column
        for column, name in enumerate(table.names)
        if column not in table.texts and (column != clock or column in kept)
        if name or not blank[column]
    ]
    _log_texts(table, texts, numbers)
    if not numbers:
        fix = "Give the table of weights or markers itself."
        raise InputError("columns", "numbers of weights or markers", "a clock alone", fix)
    others = _of_mediapipe(table.names, [c for c in numbers if c not in kept])
    kept_numbers = [column for column in numbers if column in kept]
    return np.array(sorted(_of_openface(table.names, others) + kept_numbers), dtype=np.int64)


def _log_texts(table: Table, texts: Sequence[int], numbers: Sequence[int]) -> None:
    """Log the columns of text; refuse them where there is nothing else."""
    if texts and not numbers:
        cells = table.texts[texts[0]]
        row = next(row for row, cell in enumerate(cells) if cell)
        raise table.error(row, texts[0], "a number", repr(cells[row][:40]))
    if texts:
        log.info("left out, as text: %s", listed([repr(table.names[column]) for column in texts]))


def _of_mediapipe(names: Sequence[str], columns: Sequence[int]) -> list[int]:
    """The columns without MediaPipe's ``_neutral``, which is no shape."""
    neutral = [column for column in columns if names[column] == "_neutral"]
    shapes = sum(canonical(names[column]) in ARKIT_NAMES for column in columns)
    if not neutral or shapes < _FEWEST_SHAPES:
        return list(columns)
    log.info(
        "left out, as no shape: '_neutral' of MediaPipe; facert convert --keep _neutral keeps it"
    )
    return [column for column in columns if column not in neutral]


def _of_openface(names: Sequence[str], columns: Sequence[int]) -> list[int]:
    """Of OpenFace's table the intensities of action units and its flags; of another one all."""
    units = [column for column in columns if _UNIT.fullmatch(names[column])]
    if len(units) < _FEWEST_UNITS:
        return list(columns)
    flags = [column for column in columns if role_of_name(names[column]) is not None]
    rest = [names[c] for c in columns if c not in {*units, *flags}]
    if rest:
        text = "OpenFace: %s of 0 to 5 are read; left out: %s; facert convert --keep NAME keeps "
        log.info(
            text + "one, and a table of X_0, Y_0, Z_0 ... alone is one of markers",
            plural(len(units), "action unit"),
            listed(list(map(repr, rest))),
        )
    return units + flags


def _one_subject(table: Table) -> Table:
    """The rows of the face that is seen most, of a table that has several at once."""
    numbered = (c for c, name in enumerate(table.names) if role_of_name(name) is Role.SUBJECT)
    column = next(numbered, None)
    if column is None or column in table.texts:
        return table
    values = table.numbers[:, column]
    count = Counter(values[np.isfinite(values)].tolist())
    times = _first_clock(table)
    if len(count) < 2 or times is None or len(np.unique(times)) == len(times):
        return table
    chosen, rows = count.most_common(1)[0]
    text = "%s of %s: %s of number %g are read"
    log.warning(text, plural(len(count), "face"), table.names[column], plural(rows, "row"), chosen)
    return table.rows(np.flatnonzero(values == chosen))


def _without_repeats(table: Table, clock: Clock) -> tuple[Table, Clock]:
    """The table without the few rows whose time does not rise, which the log has."""
    late = np.diff(clock.time) <= 0
    if not late.any() or late.sum() > _FEW * len(table):
        return table, clock
    kept, time = rising(clock.time, table.numbers)
    return table.rows(kept), replace(clock, time=time, rate=nominal_rate(time))


def _first_clock(table: Table) -> FloatArray | None:
    clocks = (Role.CLOCK, Role.FRAME)
    named = (c for c, name in enumerate(table.names) if role_of_name(name) in clocks)
    return next((table.numbers[:, c] for c in named if c not in table.texts), None)


def arkit_names(names: Sequence[str]) -> tuple[str, ...]:
    """ARKit's own names, where they are these but for a prefix or suffix; else the names as given.

    MediaPipe's ``_neutral`` among them stays as it is.
    """
    bare = without_affix(names)
    if bare == tuple(names):
        return bare
    own = tuple(map(canonical, bare))
    if not set(own) <= set(ARKIT_NAMES):
        return tuple(names)
    log.info("%r and others are ARKit's names with more around them: named as ARKit does", names[0])
    return own
