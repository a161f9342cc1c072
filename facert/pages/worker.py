"""One thread that does everything on a page, in order: no lock is needed anywhere else."""

from __future__ import annotations

import logging
from collections.abc import Callable
from threading import Condition, Thread

from facert.errors import FacertError

log = logging.getLogger(__name__)

Task = Callable[[], None]


class Worker:
    """Does tasks one after the other; of several that wait under one key, only the newest.

    A slider that is dragged sends more values than can be drawn: those in between are left out.

    Parameters
    ----------
    complain : callable
        Told in a line what went wrong in a task.
    tick : callable, optional
        Called about every `pause` seconds between the tasks, with nothing waiting.
    pause : float
        Seconds.
    """

    def __init__(
        self, complain: Callable[[str], None], tick: Task | None = None, pause: float = 0.04
    ) -> None:
        self._complain, self._tick, self._pause = complain, tick, pause
        self._waiting: dict[object, Task] = {}
        self._changed = Condition()
        self._open = True
        self._idle = True
        self._thread = Thread(target=self._run, daemon=True, name="facert-page")
        self._thread.start()

    def do(self, key: object, task: Task) -> None:
        """Queue a task, behind those that wait; one that waits under its key is dropped."""
        with self._changed:
            self._waiting.pop(key, None)
            self._waiting[key] = task
            self._changed.notify_all()

    def finish(self, seconds: float = 10.0) -> bool:
        """Wait until nothing is left to do; whether it came to that in time."""
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
        """What to do now, or None at the end."""
        with self._changed:
            self._idle = True
            self._changed.notify_all()
            patience = None if self._tick is None else self._pause
            self._changed.wait_for(lambda: self._waiting or not self._open, patience)
            if not self._open:
                return None
            self._idle = False
            if not self._waiting:
                return self._tick or _nothing
            key = next(iter(self._waiting))
            return self._waiting.pop(key)


def _nothing() -> None:
    """What is to be done when nothing is."""
