"""Work in several processes: results as they are done, and no process that outlives its work.

A process that dies, as the system kills one for lack of memory, costs its own call alone: that is
tried once more when nothing else runs, and is then given up. Each worker has pipes of its own:
nothing is shared, so nothing is left locked or half-written by a dead one.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar

from facert.errors import FacertError

if TYPE_CHECKING:
    from concurrent.futures import Future

Result = TypeVar("Result")

LIBRARIES = ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB", "NUMEXPR")
PATIENCE = 1.0  # seconds that a worker has to clean up when it is asked to end


def cores() -> int:
    """Number of cores this process may use: not all in a container or on a cluster."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def call_each(
    function: Callable[..., Result],
    arguments: Sequence[tuple[Any, ...]],
    jobs: int,
    begin: Callable[[], object] | None = None,
    lost: Callable[..., Result] | None = None,
) -> Iterator[Result]:
    """The results of calls of a function, in the order in which they are done.

    Parameters
    ----------
    function : callable
    arguments : sequence of tuple
        Positional arguments of each call.
    jobs : int
        Processes; 1 stays in this one.
    begin : callable, optional
        Called first in every process of its own.
    lost : callable, optional
        Makes the result of a call whose process died twice, of its arguments and the reason.

    Raises
    ------
    FacertError
        When a process died twice over a call, the others are done, and there is no `lost`.
    """
    jobs = min(jobs, len(arguments))
    if jobs < 2:
        yield from (function(*each) for each in arguments)
        return
    from concurrent.futures import ThreadPoolExecutor, as_completed

    crew = _Crew(pickle.dumps((function, begin)), max(cores() // jobs, 1))
    threads = ThreadPoolExecutor(jobs)  # each waits for one worker
    again = []
    try:
        calls = {threads.submit(crew.call, each): each for each in arguments}
        for call in as_completed(calls):
            if _died(call):
                again.append(calls[call])
            else:
                yield call.result()
        for each in again:
            crew.end()  # idle ones hold memory
            alone = threads.submit(crew.call, each)
            if not _died(alone):
                yield alone.result()
            elif lost is not None:
                yield lost(*each, str(alone.exception()))
        if again and lost is None and _died(alone):
            raise FacertError(f"{alone.exception()}")
    finally:
        threads.shutdown(wait=False, cancel_futures=True)
        crew.end(for_good=True)


class _Died(FacertError):
    """A worker is gone before its call was done."""


def _died(call: Future[Any]) -> bool:
    """Whether a call, waited for, came to nothing as its process died."""
    return isinstance(call.exception(), _Died)


class _Crew:
    """Workers that carry out calls, started as they are needed."""

    def __init__(self, setup: bytes, cores_each: int) -> None:
        self._setup, self._cores = setup, cores_each
        self._idle: list[_Worker] = []
        self._all: list[_Worker] = []
        self._ended, self._lock = False, Lock()

    def call(self, arguments: tuple[Any, ...]) -> Any:
        """The result of a call; raises `_Died`, or what the function raised."""
        worker = self._take()
        is_done, result = worker.call(pickle.dumps(arguments))
        self._idle.append(worker)
        if not is_done:
            raise result
        return result

    def end(self, for_good: bool = False) -> None:
        """Ask all workers to end, and kill those that do not."""
        with self._lock:
            self._ended = for_good
            ended, self._all, self._idle = self._all, [], []
        for worker in ended:
            worker.ask_to_end()
        for worker in ended:
            worker.end()

    def _take(self) -> _Worker:
        """A worker that is idle, or a new one."""
        with self._lock:
            if self._ended:
                raise _Died("stopped")
            if self._idle:
                return self._idle.pop()
            self._all.append(_Worker(self._setup, self._cores))
            return self._all[-1]


class _Worker:
    """A process that runs `facert.evaluation.worker`."""

    def __init__(self, setup: bytes, cores_each: int) -> None:
        from subprocess import PIPE, Popen

        code = f"from facert.evaluation.worker import main; main({os.getpid()})"
        threads = {f"{name}_NUM_THREADS": str(cores_each) for name in LIBRARIES}
        path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)  # noqa: PTH109
        self._process = Popen(
            [sys.executable, "-P", "-c", code],
            stdin=PIPE,
            stdout=PIPE,
            env={**os.environ, **threads, "PYTHONPATH": path},
            # Ctrl-C in a terminal goes to all processes of a group; this one tells its workers.
            process_group=None if sys.platform == "win32" else 0,
        )
        assert self._process.stdin is not None  # both are pipes
        assert self._process.stdout is not None
        self._calls, self._results = self._process.stdin, self._process.stdout
        self._setup = setup

    def call(self, arguments: bytes) -> tuple[bool, Any]:
        """Whether a call was done, and its result or exception."""
        from facert.evaluation.worker import receive, send

        try:
            for message in (self._setup, arguments):
                if message:
                    send(self._calls, message)
            self._setup = b""  # once will do
            return pickle.loads(receive(self._results))  # type: ignore[no-any-return]
        except (EOFError, OSError):
            raise _Died(self._reason()) from None

    def ask_to_end(self) -> None:
        """Let the worker clean up and end."""
        self._process.terminate()

    def end(self) -> None:
        """Wait until the worker has ended, but not for long."""
        from subprocess import TimeoutExpired

        try:
            self._process.wait(PATIENCE)
        except TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for pipe in (self._calls, self._results):
            try:
                pipe.close()
            except OSError:  # what was to be sent to a dead one
                continue

    def _reason(self) -> str:
        from facert.evaluation.worker import NO_MEMORY

        status = self._process.wait()
        how = f"by {signal.Signals(-status).name}" if status < 0 else f"with status {status}"
        advice = "if for lack of memory, use fewer --jobs"
        if status == NO_MEMORY:
            how, advice = "for lack of memory", "use fewer --jobs"
        elif -status == getattr(signal, "SIGXCPU", None):
            how, advice = "at the limit of CPU time", "raise ulimit -t"
        return f"a process was killed; it ended {how}, and again when tried alone; {advice}"
