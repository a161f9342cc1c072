"""The signals that ask a command to end: one line, and 128 + the signal's number as status.

Python's own way is to raise KeyboardInterrupt wherever the main thread is, for Ctrl-C alone. Raised
in an import, a destructor or a callback of C it ends in a traceback, or in nothing; while C code
computes it is not raised at all. Here SIGINT, SIGTERM, SIGHUP and SIGXCPU are one thing, which is
raised where Python code can take it, and a thread sees to it that the process ends in any case.
Before a command begins nothing is at stake, and the process ends at once; so it does at a second
signal.

Nothing heavy is imported: the handlers stand before the rest of facert is loaded.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import contextmanager, suppress

from facert.data.raising import can_raise

TYPE_CHECKING = False  # as in typing, which takes its time
if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

ENDING = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGXCPU")
    if hasattr(signal, name)
)
CPU_TIME = getattr(signal, "SIGXCPU", None)
"""It comes again every second, until the system kills a process that does not end."""
REASONS = {CPU_TIME: "the limit of CPU time (ulimit -t) is reached"}
TICK = 0.05  # seconds between two tries to raise it
STUCK = 2.0  # seconds until a process ends that comes to no place where it can be raised
GRACE = 20.0  # seconds for cleaning up and keeping what was done, after it was raised
SHOW_CURSOR = b"\x1b[?25h"


class Stopped(KeyboardInterrupt):
    """A signal asks the command to end; its notes say how it may be continued."""


class Signals:
    """What a process was asked by signals, and what it makes of it."""

    def __init__(self) -> None:
        self.number: int | None = None  # The first signal that came
        self._installed: list[int] = []
        self._is_working = False
        self._unraised = False  # It came, but where nothing can be raised
        self._instead: threading.Event | None = None

    @property
    def status(self) -> int:
        """The exit status of a process that was asked to end."""
        return 128 + (self.number or signal.SIGINT)

    def install(self) -> None:
        """Handle the signals from now on, but for those that the process was started to ignore."""
        asked = [number for number in ENDING if signal.getsignal(number) != signal.SIG_IGN]
        for number in asked:
            signal.signal(number, self._handle)
        self._installed = asked
        sys.unraisablehook = self._unraisable
        if os.name == "posix":
            read, write = os.pipe()
            os.set_blocking(write, False)
            signal.set_wakeup_fd(write, warn_on_full_buffer=False)
            threading.Thread(target=self._watch, args=(read,), daemon=True).start()
            os.register_at_fork(after_in_child=self._leave)

    def ignore(self) -> None:
        """Ignore the signals: the command is done, and its status is known."""
        for number in self._installed:
            signal.signal(number, signal.SIG_IGN)

    @contextmanager
    def raising(self) -> Iterator[None]:
        """Let a signal raise `Stopped` in the block."""
        self._is_working, self.number = True, None
        try:
            yield
        finally:
            self._is_working = False

    @contextmanager
    def setting(self, event: threading.Event) -> Iterator[None]:
        """Let the first signal set an event in the block, without haste."""
        before = {number: signal.getsignal(number) for number in ENDING}
        self._instead = event
        for number in ENDING:
            if before[number] != signal.SIG_IGN:
                signal.signal(number, self._handle)
        try:
            yield
        finally:
            self._instead = None
            for number, handler in before.items():
                signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.number is not None and not self._unraised:
            if number == self.number == CPU_TIME:
                return
            self._end()
        self.number = number
        if self._instead is not None:
            self._instead.set()
        elif not self._is_working:
            self._end()
        else:
            self._unraised = not can_raise(frame)
            if not self._unraised:
                stopped = Stopped()
                if number in REASONS:
                    stopped.add_note(REASONS[number])
                raise stopped

    def _watch(self, pipe: int) -> None:
        """End the process some time after a signal, whatever the main thread does."""
        number = 0
        while number not in ENDING or self._instead is not None:
            number = os.read(pipe, 1)[0]
        began = time.monotonic()
        while time.monotonic() < began + (STUCK if self._is_stuck else GRACE):
            time.sleep(TICK)
            if self._unraised:
                os.kill(os.getpid(), number)
        self.number = self.number or number
        self._end()

    @property
    def _is_stuck(self) -> bool:
        return self.number is None or self._unraised

    def _unraisable(self, ignored: sys.UnraisableHookArgs) -> None:
        """Raise it again later where a destructor or a callback let it go by."""
        if issubclass(ignored.exc_type, Stopped):
            self._unraised = True
        else:
            sys.__unraisablehook__(ignored)

    def _leave(self) -> None:
        """Handle no signals in a fork: it is another process, which its parent ends."""
        signal.set_wakeup_fd(-1)
        for number in self._installed:
            signal.signal(number, signal.SIG_DFL)

    def _end(self) -> None:
        """End the process at once; what it was writing has a temporary name."""
        with suppress(OSError):
            said = ": ".join(["stopped", *filter(None, [REASONS.get(self.number)])])
            os.write(2, (SHOW_CURSOR if os.isatty(2) else b"") + f"{said}\n".encode())
        os._exit(self.status)


signals = Signals()
