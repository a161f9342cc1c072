"""A process that carries out calls for another one, and ends with it."""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import sys
from queue import SimpleQueue
from threading import Thread, Timer
from types import FrameType
from typing import Any, BinaryIO, NoReturn

from facert.data.raising import can_raise
from facert.errors import FacertError

LENGTH = 8  # bytes in front of a message that say how long it is
ENDED = 128 + signal.SIGTERM
NO_MEMORY = 70
"""The exit status of a worker that has no memory for its calls."""
AGAIN = 0.02  # seconds until it is tried again to end


def send(pipe: BinaryIO | Any, message: bytes) -> None:
    """Write a message to a pipe."""
    pipe.write(len(message).to_bytes(LENGTH, "big"))
    pipe.write(message)
    pipe.flush()


def receive(pipe: BinaryIO | Any) -> bytes:
    """Read a message from a pipe; raises EOFError where it was cut off."""
    length = int.from_bytes(_exactly(pipe, LENGTH), "big")
    return _exactly(pipe, length)


def _exactly(pipe: BinaryIO | Any, count: int) -> bytes:
    data: bytes = pipe.read(count)
    if len(data) < count:
        raise EOFError
    return data


def main(parent: int) -> None:
    """Carry out the calls that come by standard input, until it ends or the parent does.

    The first message has the function, and what is to be called before it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's affair
    signal.signal(signal.SIGTERM, _end)
    _end_with(parent)
    calls: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_listen, args=(calls,), daemon=True).start()
    results = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever prints does not print into the results
    try:
        function, begin = pickle.loads(calls.get())
        if begin is not None:
            begin()
        while True:
            send(results, _outcome(function, calls.get()))
    except SystemExit:  # asked to end, and everything is cleaned up
        os._exit(ENDED)
    except MemoryError:
        os._exit(NO_MEMORY)


def _outcome(function: Any, call: bytes) -> bytes:
    """Whether a call was done, and its result or exception."""
    try:
        return pickle.dumps((True, function(*pickle.loads(call))))
    except Exception as error:
        try:
            found = pickle.dumps((False, error))
            pickle.loads(found)  # not all exceptions are made of what they were made with
        except Exception:
            found = pickle.dumps((False, FacertError(f"{type(error).__name__}: {error}")))
        return found


def _listen(calls: SimpleQueue[bytes]) -> NoReturn:
    """Take in calls; the pipe's end is the parent's, whatever is being computed."""
    try:
        while True:
            calls.put(receive(sys.stdin.buffer))
    except (EOFError, OSError):
        os._exit(ENDED)
    except MemoryError:  # or the parent would wait for ever
        os._exit(NO_MEMORY)


def _end_with(parent: int) -> None:
    """Let Linux end this process with its parent, also while C code keeps the others waiting."""
    if sys.platform == "linux":
        set_death_signal = 1  # PR_SET_PDEATHSIG
        ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL)
        if os.getppid() != parent:  # it was gone before
            os._exit(ENDED)


def _end(number: int, frame: FrameType | None) -> None:
    if can_raise(frame):
        raise SystemExit(ENDED)
    Timer(AGAIN, os.kill, (os.getpid(), number)).start()
