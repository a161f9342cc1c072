"""The markers or weights that a model knows, and where a source has them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import NameIndex
from facert.data.take import Source, SourceKind
from facert.data.text import listed, plural
from facert.errors import InputError

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class SourceColumns:
    """Indices of a model's columns among the numbers of a source's frames."""

    names: tuple[str, ...]  # Of the model
    # (d_x,): Of each column among the numbers of a frame; any for those that the source lacks
    index: IntArray
    absent: IntArray  # (a,): The columns that it lacks
    count: int  # Of the source's names

    def pick(self, X: FloatArray) -> FloatArray:
        """Frames (T, d), or one (d,), in the model's order; NaN in absent columns."""
        picked = X.take(self.index, axis=-1)
        if len(self.absent):
            picked[..., self.absent] = np.nan
        return picked

    def arrange(self, source: Source) -> Source:
        """The source with the model's markers or weights, in their order."""
        X = self.pick(source.matrix)
        return Source(X.reshape(len(X), len(self.names), *source.values.shape[2:]), self.names)


@dataclass(frozen=True)
class SourceLayout:
    """The markers or weights that a model takes, in its order."""

    kind: SourceKind
    names: tuple[str, ...]

    @property
    def width(self) -> int:
        """Numbers of each marker or weight, 3 or 1."""
        return 3 if self.kind == "markers" else 1

    def columns(self, names: Sequence[str], quiet: bool = False) -> SourceColumns:
        """The model's columns in a source with these names.

        A marker that the source lacks is one that was not observed: the job goes on, with a
        warning unless it is to be `quiet`. Where it has unknown names instead, or lacks most, it is
        misspelt or another set.

        Raises
        ------
        InputError
            For misspelt names, names of another set, or of two subjects.
        """
        index = NameIndex.among(names, self.names, "/source/names", quiet=quiet)
        absent = [name for name in self.names if index.find(name) is None]
        present = [name for name in self.names if index.find(name) is not None]
        extra = len(names) - len(present)
        if absent and (extra or len(absent) > len(present)):
            index.places(absent, "/source/names")  # names which, and the nearest name
        if absent and not quiet:
            log.warning("taken as not observed, as the take lacks them: %s", ", ".join(absent))
        if extra and not quiet:
            known = set(index.places(present, "/source/names").tolist())
            others = [repr(name) for place, name in enumerate(names) if place not in known]
            text = "not in the model, passed over: %s of the source (%s)"
            log.info(text, plural(extra, "name"), listed(others))
        seen = np.isin(self.names, present)
        places = np.zeros(len(self.names), dtype=np.int64)
        places[seen] = index.places(present, "/source/names")
        numbers = np.arange(self.width)
        return SourceColumns(
            self.names,
            (places[:, None] * self.width + numbers).ravel(),
            np.flatnonzero(np.repeat(~seen, self.width)),
            len(names),
        )

    def arrange(self, source: Source) -> Source:
        """A source in the model's order.

        Raises
        ------
        InputError
            When it is of another kind, or as in `columns`.
        """
        self.require_kind(source.kind)
        return self.columns(source.names).arrange(source)

    def require_kind(self, kind: SourceKind) -> None:
        """Refuse a source of another kind."""
        if kind != self.kind:
            raise InputError(
                "/source", self.kind, kind, "Give a take of the kind it was trained on."
            )
