"""Which markers or weights a model knows, and where a source has them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import NameIndex, match
from facert.data.take import Source, SourceKind
from facert.errors import InputError

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Places:
    """Where a source has what a model knows.

    Parameters
    ----------
    theirs, ours : array of int, shape (k,)
        Indices of the same names in the source and in the model.
    count : int
        How many names the model has.
    """

    theirs: IntArray
    ours: IntArray
    count: int

    def pick(self, values: FloatArray) -> FloatArray:
        """Values (T, theirs, ...) in the model's order, NaN where the source has none."""
        picked = np.full((len(values), self.count, *values.shape[2:]), np.nan)
        picked[:, self.ours] = values[:, self.theirs]
        return picked


class FramePicker:
    """`Places.pick` for single frames, as flat rows.

    Parameters
    ----------
    places : Places
    names : int
        How many the source has.
    numbers : int
        Of each: 3 for a marker, 1 for a weight.
    """

    def __init__(self, places: Places, names: int, numbers: int) -> None:
        nothing = names
        theirs = np.full(places.count, nothing)
        theirs[places.ours] = places.theirs
        self._index = (theirs[:, None] * numbers + np.arange(numbers)).ravel()
        self._padded = np.full((names + 1) * numbers, np.nan)
        self._own = self._padded[: names * numbers]

    def pick(self, values: FloatArray) -> FloatArray:
        """Values (names, ...) in the model's order, (d_x,); NaN where the source has none."""
        self._own[:] = values.ravel()
        return self._padded.take(self._index)


@dataclass(frozen=True)
class SourceLayout:
    """What a model takes.

    Parameters
    ----------
    kind : {"markers", "weights"}
    names : tuple of str
    """

    kind: SourceKind
    names: tuple[str, ...]

    def places(self, names: Sequence[str]) -> Places:
        """Where a source with these names has the model's.

        A marker that the source lacks is one that was not observed: the job goes on, with a
        warning. Where it has unknown names instead, or lacks most, it is misspelt or another set.

        Raises
        ------
        InputError
            For misspelt names, or names of another set.
        """
        index = NameIndex(names)
        absent = [name for name in self.names if index.find(name) is None]
        present = [name for name in self.names if index.find(name) is not None]
        extra = len(names) - len(present)
        if absent and (extra or len(absent) > len(present)):
            match(absent, names, "/source/names")  # tells which, and the nearest name
        theirs = match(present, names, "/source/names")
        if absent:
            log.warning("taken as not observed, as the take lacks them: %s", ", ".join(absent))
        if extra:
            log.info("%d names of the source are not in the model: passed over", extra)
        ours = [self.names.index(name) for name in present]
        return Places(np.asarray(theirs), np.array(ours, dtype=np.int64), len(self.names))

    def arrange(self, source: Source) -> Source:
        """A source in the model's order.

        Raises
        ------
        InputError
            When it is of another kind, or as in `places`.
        """
        self.require_kind(source.kind)
        return Source(self.places(source.names).pick(source.values), self.names)

    def require_kind(self, kind: SourceKind) -> None:
        """Refuse a source of another kind."""
        if kind != self.kind:
            raise InputError(
                "/source", self.kind, kind, "Give a take of the kind it was trained on."
            )
