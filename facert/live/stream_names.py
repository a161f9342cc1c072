"""Names of a stream, which come one by one, and where the wanted ones are among them."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from facert.data.alignment import NEARLY, Alignment
from facert.data.arrays import IntArray
from facert.data.names import NameIndex
from facert.data.text import listed, plural, printable
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
    there are names enough to be sure. Of two names that mean the same the first counts.

    Parameters
    ----------
    wanted : sequence of str, length D
    """

    def __init__(self, wanted: Sequence[str]) -> None:
        self._wanted = tuple(wanted)
        self._look_up_in(NameIndex(self._wanted))
        self._rows: dict[tuple[str, str], int] = {}
        self._aligned: Alignment | None = None
        self._settled = self._tries = 0
        self._warned = self._two = False
        self.rows: IntArray = np.full(len(self._wanted), -1, dtype=np.int64)
        """(D,): The row of each wanted name; -1 where the stream has not brought it."""

    @property
    def count(self) -> int:
        """The number of the stream's names."""
        return len(self._rows)

    @property
    def unknown(self) -> list[str]:
        """The stream's names that are not wanted."""
        used = set(self.rows.tolist())
        return [label for row, label in enumerate(self._labels()) if row not in used]

    @property
    def absent(self) -> list[str]:
        """The wanted names that the stream has not brought."""
        return [name for name, row in zip(self._wanted, self.rows, strict=True) if row < 0]

    def row(self, name: str, path: str = "") -> int | None:
        """The row of a name that comes under a path, from 0; None where there are too many."""
        found = self._rows.get((path, name))
        if found is None and len(self._rows) < MOST:
            found = self._rows[path, name] = len(self._rows)
        return found

    def settle(self) -> None:
        """Find the wanted names among those that came since."""
        if len(self._rows) == self._settled:
            return
        labels = self._labels()
        known = self._place(labels)
        if not known and self._is_time() and self._align(labels):
            self._place(labels)
        if not self._two:
            self._place([name for _, name in self._rows])
        self._settled = len(self._rows)

    def report(self) -> None:
        """Log which names are not known, where that is most of them, and which did not come."""
        unknown, absent = self.unknown, self.absent
        if unknown and len(absent) > (1 - NEARLY) * len(self._wanted):
            log.warning("names unknown: %s; the model knows %s", listed(unknown), listed(absent))
        elif absent:
            count = plural(len(absent), "name")
            log.info("%s not sent yet, not observed until then: %s", count, listed(absent))

    def _look_up_in(self, index: NameIndex) -> None:
        self._find = lru_cache(2 * MOST)(index.find)  # as all are looked up with each new one

    def _labels(self) -> list[str]:
        """The names; with its path, where a name comes under several."""
        count = Counter(name for _, name in self._rows)
        return [name if count[name] == 1 else f"{path}/{name}" for path, name in self._rows]

    def _place(self, labels: Sequence[str]) -> bool:
        """Give each wanted name that has none the row of its label; return if all are wanted."""
        places = [self._find(label) for label in labels]
        for row, place in enumerate(places):
            if place is None:
                continue
            first = self.rows[place]
            if first < 0:
                self.rows[place] = row
            elif first != row and not self._warned:
                both = [f"{path}/{name}" if path else name for path, name in self._rows]
                text = "%s and %s are one name: the first counts"
                log.warning(text, printable(both[first]), printable(both[row]))
                self._warned = True
        return None not in places

    def _is_time(self) -> bool:
        few = len(self._rows) <= MOST_ALIGNED
        return few and (self._tries < _TRIES or 2 * len(self._rows) >= 3 * self._settled)

    def _align(self, labels: Sequence[str]) -> bool:
        """Look for a prefix or suffix without which the names are those that are wanted."""
        self._tries += 1
        try:
            index = NameIndex.among(self._wanted, labels, "stream", quiet=True)
        except InputError as error:
            if not self._two:
                log.warning("names of the stream are %s: send those of one", error.found)
            self._two = True
            return False
        if index.aligned is None or _same(index.aligned, self._aligned):
            return False
        self._look_up_in(index)
        self._aligned = index.aligned
        log.info("%s", self._aligned.text(labels, self._wanted))
        return True


def _same(one: Alignment, other: Alignment | None) -> bool:
    return other is not None and (one.of_wanted, one.of_among) == (other.of_wanted, other.of_among)
