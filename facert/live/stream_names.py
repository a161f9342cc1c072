"""Names of a stream, which come one by one, and where the wanted ones are among them."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from facert.data.alignment import NEARLY, Alignment
from facert.data.arrays import IntArray
from facert.data.names import NameIndex
from facert.data.text import listed, plural
from facert.errors import InputError

log = logging.getLogger("facert")

MOST = 4096
"""Names of a stream that are kept: a flood of others must not fill the memory."""
MOST_ALIGNED = 512
"""Names of a stream up to which a prefix is looked for: it takes milliseconds."""
_TRIES = 16
"""So often a prefix is looked for whenever there are new names, then when they are more by half."""


class StreamNames:
    """Rows of a stream's names, and the row of each wanted name.

    Names are wanted in any spelling; a prefix or a suffix that all have is seen through as soon as
    there are names enough to be sure. The first of two names that mean the same counts.

    Parameters
    ----------
    wanted : sequence of str, length D
    """

    def __init__(self, wanted: Sequence[str]) -> None:
        self._wanted = tuple(wanted)
        self._index = NameIndex(self._wanted)
        self._rows: dict[str, int] = {}
        self._paths: dict[str, str] = {}
        self._aligned: Alignment | None = None
        self._settled = self._tries = 0
        self._two = False
        self.rows: IntArray = np.full(len(self._wanted), -1, dtype=np.int64)
        """(D,): The row of each wanted name; -1 where the stream has not brought it."""

    @property
    def unknown(self) -> list[str]:
        """The stream's names that are not wanted."""
        used = set(self.rows.tolist())
        return [name for name, row in self._rows.items() if row not in used]

    @property
    def absent(self) -> list[str]:
        """The wanted names that the stream has not brought."""
        return [name for name, row in zip(self._wanted, self.rows, strict=True) if row < 0]

    @property
    def count(self) -> int:
        """The number of the stream's names."""
        return len(self._rows)

    def row(self, name: str, path: str = "") -> int | None:
        """The row of a name that the stream brings, from 0; None where there are too many.

        Under a second path, the same name is another one.
        """
        if len(self._paths) < MOST and self._paths.setdefault(name, path) != path:
            self._warn_of_two(f"{self._paths[name]}/{name}", f"{path}/{name}")
            name = f"{path}/{name}"
        found = self._rows.get(name)
        if found is None and len(self._rows) < MOST:
            found = self._rows[name] = len(self._rows)
        return found

    def settle(self) -> None:
        """Find the wanted names among those that came since."""
        if len(self._rows) == self._settled:
            return
        new = list(self._rows)[self._settled :]
        if not self._place(new) and self._is_time():
            self._align()
        self._settled = len(self._rows)

    def report(self) -> None:
        """Log which names are not known, where that is most of them, and which did not come."""
        unknown, absent = self.unknown, self.absent
        if unknown and len(absent) > (1 - NEARLY) * len(self._wanted):
            log.warning("names unknown: %s; the model knows %s", listed(unknown), listed(absent))
        elif absent:
            count = plural(len(absent), "name")
            log.info("%s not sent yet, not observed until then: %s", count, listed(absent))

    def _place(self, names: Sequence[str]) -> bool:
        """Place names as they are to be read now; return whether all of them are wanted."""
        known = True
        for name in names:
            place = self._index.find(name)
            known = known and place is not None
            if place is None:
                continue
            if self.rows[place] < 0:
                self.rows[place] = self._rows[name]
            elif self.rows[place] != self._rows[name]:
                self._warn_of_two(list(self._rows)[self.rows[place]], name)
        return known

    def _warn_of_two(self, first: str, second: str) -> None:
        if not self._two:
            log.warning("%r and %r come for one name: the first counts", first, second)
        self._two = True

    def _is_time(self) -> bool:
        few = len(self._rows) <= MOST_ALIGNED
        return few and (self._tries < _TRIES or 2 * len(self._rows) >= 3 * self._settled)

    def _align(self) -> None:
        """Look for a prefix or suffix without which the names are those that are wanted."""
        self._tries += 1
        try:
            index = NameIndex.among(self._wanted, list(self._rows), "stream", quiet=True)
        except InputError as error:  # one subject that is known already stays
            if not self._two:
                log.warning("names of the stream are %s: send those of one", error.found)
            self._two = True
            return
        if index.aligned is None or _same(index.aligned, self._aligned):
            return
        self._index, self._aligned = index, index.aligned
        log.info("%s", self._aligned.text(list(self._rows), self._wanted))
        self.rows[:] = -1
        self._place(list(self._rows))


def _same(one: Alignment, other: Alignment | None) -> bool:
    return other is not None and (one.of_wanted, one.of_among) == (other.of_wanted, other.of_among)
