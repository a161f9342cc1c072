"""The worker of a page, one thread for all its tasks, and the frame that is shown.

As the thread does everything in order, no lock is needed anywhere else.
"""

from __future__ import annotations

import logging
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition, Thread
from typing import TYPE_CHECKING

import numpy as np

from facert.data.arrays import FloatArray
from facert.errors import FacertError
from facert.pages.server import show_errors

if TYPE_CHECKING:
    from viser import ViserServer

log = logging.getLogger(__name__)

Task = Callable[[], None]


class Worker:
    """A thread for tasks, in their order; of neighbours that wait under one key, the newest.

    A slider that is dragged sends more values than can be drawn: those in between are left out.

    Parameters
    ----------
    complain : callable
        Called with a line about what went wrong in a task.
    tick : callable, optional
        Called about every `pause` seconds between the tasks, with nothing waiting.
    pause : float
        Seconds.
    """

    def __init__(
        self, complain: Callable[[str], None], tick: Task | None = None, pause: float = 0.04
    ) -> None:
        self._complain, self._tick, self._pause = complain, tick, pause
        self._waiting: deque[tuple[object, Task]] = deque()
        self._changed = Condition()
        self._open = True
        self._idle = True
        self._thread = Thread(target=self._run, daemon=True, name="facert-page")
        self._thread.start()

    def do(self, key: object, task: Task) -> None:
        """Queue a task, in place of the one queued last if that waits under the same key."""
        with self._changed:
            if self._waiting and self._waiting[-1][0] == key:
                self._waiting.pop()
            self._waiting.append((key, task))
            self._changed.notify_all()

    def finish(self, seconds: float = 10.0) -> bool:
        """Wait until nothing is left to do; return whether that was in time."""
        with self._changed:
            return self._changed.wait_for(lambda: self._idle and not self._waiting, seconds)

    def stop(self) -> None:
        """End after the task that is under way."""
        with self._changed:
            self._open = False
            self._changed.notify_all()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while (task := self._next()) is not None:
            try:
                task()
            except FacertError as error:
                self._complain(str(error))
            except Exception as error:  # a page must outlive a mistake of ours
                log.exception("a task of the page failed")
                self._complain(f"{type(error).__name__}: {error}")

    def _next(self) -> Task | None:
        """The next task, or None at the end."""
        with self._changed:
            self._idle = True
            self._changed.notify_all()
            patience = None if self._tick is None else self._pause
            self._changed.wait_for(lambda: self._waiting or not self._open, patience)
            if not self._open:
                return None
            self._idle = False
            if not self._waiting:
                return self._tick  # after a pause
            return self._waiting.popleft()[1]


@dataclass
class Playback:
    """The frame that is shown."""

    time: FloatArray
    """Seconds, rising, (T,)."""
    frame: int = 0
    playing: bool = False
    speed: float = 1.0
    """Seconds of the performance a second."""

    def __post_init__(self) -> None:
        self._moment = float(self.time[self.frame])

    def seek(self, frame: int) -> None:
        """Go to a frame; the nearest one that there is."""
        self.frame = min(max(frame, 0), len(self.time) - 1)
        self._moment = float(self.time[self.frame])

    def advance(self, seconds: float) -> bool:
        """Let time pass, from the last frame on to the first; return whether the frame changed."""
        if not self.playing:
            return False
        before, self._moment = self.frame, self._moment + self.speed * seconds
        if self._moment > self.time[-1]:
            self._moment = float(self.time[0])
        # The last frame that has begun.
        self.frame = max(int(np.searchsorted(self.time, self._moment, side="right")) - 1, 0)
        return self.frame != before


class PlayedPage(ABC):
    """A page that shows one frame of a performance at a time.

    Parameters
    ----------
    server : ViserServer
    time : array, shape (T,)
        Times of the frames.
    width : int
        Width of the panel at the right, in pixels.
    """

    def __init__(self, server: ViserServer, time: FloatArray, width: int) -> None:
        self._server, self.playback = server, Playback(time)
        self._steps: deque[int] = deque()  # asked for and not yet taken
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(width)

    def start(self) -> None:
        """Begin with the tasks and the clock, when everything is on the page."""
        self._clock = time.perf_counter()
        self.worker = Worker(show_errors(self._server), self._tick)

    def stop(self) -> None:
        """Stop the worker."""
        self.worker.stop()

    def seek(self, frame: int) -> None:
        """Go to a frame."""
        self.worker.do("seek", lambda: self._go(frame))

    def step(self, frames: int) -> None:
        """Go so many frames on, or back, and stay there."""
        self._steps.append(frames)
        self.worker.do("step", self._take_steps)

    def toggle(self) -> None:
        """Play, or pause."""
        self.worker.do(object(), self._toggle)

    def _take_steps(self) -> None:
        frames = sum(self._steps.popleft() for _ in range(len(self._steps)))
        self.playback.playing = False
        self._go(self.playback.frame + frames)

    def _toggle(self) -> None:
        self.playback.playing = not self.playback.playing
        self._go(self.playback.frame)

    def _go(self, frame: int) -> None:
        self._leave()
        self.playback.seek(frame)
        self._show_frame()

    def _tick(self) -> None:
        now = time.perf_counter()
        passed, self._clock = now - self._clock, now
        if self.playback.playing:
            self._leave()
        if self.playback.advance(passed):
            self._show_frame()

    def _leave(self) -> None:  # noqa: B027 - there may be nothing to keep
        """Keep what belongs to the frame that is shown, before another one may be."""

    @abstractmethod
    def _show_frame(self) -> None:
        """Show the frame that `playback` has come to."""
