"""What a person did to poses, so that it can be undone and done again."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from facert.pages.pose_editor import Edit
from facert.pages.posed_take import Label

PAUSE = 1.0
"""Seconds: changes of one kind that follow each other faster are one, as of a slider dragged."""
MOST = 500


@dataclass(frozen=True, eq=False)
class FrameState:
    """A frame as it is being posed."""

    take: int
    frame: int
    edit: Edit
    saved: Label | None
    """What was saved for it, if anything."""

    @property
    def place(self) -> tuple[int, int]:
        """Which take, and which frame of it."""
        return self.take, self.frame


@dataclass(frozen=True, eq=False)
class Change:
    """A change of one frame's pose."""

    what: str
    """In words."""
    before: FrameState
    after: FrameState


class History:
    """Changes, the newest of which can be undone, and done again until there is another.

    Parameters
    ----------
    clock : callable
        Seconds, rising.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._done: list[Change] = []
        self._undone: list[Change] = []
        self._kind: object = None
        self._last = -PAUSE

    def add(self, change: Change, kind: object) -> None:
        """Remember a change; one of the same kind in the same frame just before becomes one."""
        now = self._clock()
        same = self._done and kind == self._kind and now - self._last < PAUSE
        if same and self._done[-1].after.place == change.before.place:
            change = replace(change, before=self._done.pop().before)
        self._done = [*self._done, change][-MOST:]
        self._undone.clear()
        self._kind, self._last = kind, now

    def undo(self) -> Change | None:
        """The newest change that is not undone, which from now on is."""
        return self._move(self._done, self._undone)

    def redo(self) -> Change | None:
        """The change that was undone last, which from now on is not."""
        return self._move(self._undone, self._done)

    def _move(self, source: list[Change], target: list[Change]) -> Change | None:
        self._kind = None
        if not source:
            return None
        target.append(source.pop())
        return target[-1]
