"""Several takes of one actor with poses of one character, that are learned from together.

Each stays a take of its own, with its own clock; they share the source's names, the unit and the
controls, which `facert.data.matching_takes` sees to. `Takes.joined` is their frames one after the
other, for all that looks at frames one by one.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.take import Take
from facert.data.text import plural

log = logging.getLogger("facert")

PAUSE = 1.0
"""Seconds between two takes where their frames stand one after the other."""


@dataclass(frozen=True, eq=False)
class Takes:
    """Takes with the same source, unit and controls.

    Parameters
    ----------
    parts : sequence of Take
    names : sequence of str
        Of each take, for messages: its file; empty for a single one.
    animation : array, shape (n, P), or None
        Poses without a frame: those of all takes, and others.
    """

    parts: tuple[Take, ...]
    names: tuple[str, ...]
    animation: FloatArray | None = None

    @cached_property
    def starts(self) -> IntArray:
        """Index of each take's first frame among those of all, and the number of all, (n + 1,)."""
        return np.cumsum([0, *map(len, self.parts)], dtype=np.int64)

    @property
    def named(self) -> list[tuple[Take, str]]:
        """Each take with its name; a single one needs none."""
        return list(zip(self.parts, self.names, strict=True))

    @property
    def labels(self) -> int:
        """Number of posed frames of all takes."""
        return sum(len(part.labels) for part in self.parts)

    @property
    def posed(self) -> Takes:
        """Those with a posed frame; all where none has."""
        posed = [place for place, part in enumerate(self.parts) if len(part.labels)]
        if len(posed) in (0, len(self.parts)):
            return self
        names = tuple(self.names[place] for place in posed)
        return replace(self, parts=tuple(self.parts[place] for place in posed), names=names)

    def with_parts(self, parts: Sequence[Take]) -> Takes:
        """The same with other takes in place of these."""
        return replace(self, parts=tuple(parts))

    def located(self, frames: IntArray) -> tuple[IntArray, IntArray]:
        """The take of each frame of `joined`, and its number in it, (n,)."""
        takes = np.searchsorted(self.starts, frames, side="right") - 1
        return takes, frames - self.starts[takes]

    def indices(self, frames: Sequence[IntArray]) -> IntArray:
        """The frames of each take by their numbers in `joined`, (n,)."""
        starts = self.starts[:-1]
        return np.concatenate([own + start for own, start in zip(frames, starts, strict=True)])

    def frame_name(self, frame: int) -> str:
        """A frame of `joined` for people: its number, with the file where the take has a name."""
        takes, numbers = self.located(np.array([frame]))
        name = self.names[takes[0]]
        return f"{name}:{numbers[0]}" if name else str(numbers[0])

    @cached_property
    def joined(self) -> Take:
        """All frames, one take after the other, with all animation; a single take is itself.

        From one take to the next no frame follows another.
        """
        first = self.parts[0]
        if len(self.parts) == 1:
            same = self.animation is first.animation
            return first if same else replace(first, animation=self.animation)
        return Take(
            time=_one_after_the_other([part.time for part in self.parts]),
            source=first.source.followed_by([part.source for part in self.parts[1:]]),
            controls=first.controls,
            params=self._poses("params"),
            std=self._poses("std"),
            animation=self.animation,
            fps=first.fps,
            units=first.units,
            up_axis=first.up_axis,
        )

    def _poses(self, field: str) -> FloatArray | None:
        """Poses of all takes, or their deviations, NaN where a take has none; None without any."""
        found = [getattr(part, field) for part in self.parts]
        if all(one is None for one in found):
            return None
        assert self.parts[0].controls is not None  # poses come with controls
        none = np.full(len(self.parts[0].controls.names), np.nan)
        rows = zip(self.parts, found, strict=True)
        return np.concatenate(
            [np.tile(none, (len(part), 1)) if one is None else one for part, one in rows]
        )


def same_recordings(takes: Takes) -> Iterator[tuple[int, int]]:
    """Each two takes with the very same frames, as a recording and its corrected result have."""
    for one, other in combinations(range(len(takes.parts)), 2):
        first, second = (takes.parts[place].source.values for place in (one, other))
        if np.array_equal(first, second, equal_nan=True):
            yield one, other


def posed_once(takes: Takes) -> Takes:
    """The takes with one pose for each frame of a recording: that of the last take of it."""
    parts = list(takes.parts)
    for one, other in same_recordings(takes):
        both = np.intersect1d(parts[one].labels, parts[other].labels)
        params = parts[one].params
        if params is None or not len(both):
            continue
        params = params.copy()
        params[both] = np.nan
        parts[one] = replace(parts[one], params=params, corrections=None)
        text = "%s and %s are of the same recording: of %s posed in both, the poses of %s count"
        names = takes.names[one], takes.names[other]
        log.warning(text, *names, plural(len(both), "frame"), names[1])
    return takes.with_parts(parts)


def separated(parts: Sequence[FloatArray]) -> FloatArray:
    """Frames of several takes, (T, d), with a row of NaN between: no step leads from one to next.

    Differences from frame to frame that cross a border are then unknown.
    """
    rows = [parts[0]]
    for part in parts[1:]:
        rows += [np.full((1, part.shape[1]), np.nan), part]
    return rows[0] if len(rows) == 1 else np.concatenate(rows)


def _one_after_the_other(times: Sequence[FloatArray]) -> FloatArray:
    """Seconds (T,) in which takes follow each other after a pause."""
    shifted = [times[0]]
    for _, time in pairwise(times):
        shifted.append(time - time[0] + shifted[-1][-1] + PAUSE)
    return np.concatenate(shifted)
