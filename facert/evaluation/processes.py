"""Work in several processes: results as they are done, and no process that outlives its work."""

from __future__ import annotations

import os
import signal
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from threading import Thread
from typing import Any, TypeVar

from facert.data.memory import share_memory
from facert.errors import FacertError

Result = TypeVar("Result")


def cores() -> int:
    """Number of cores this process may use: not all in a container or on a cluster."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def call_each(
    function: Callable[..., Result],
    arguments: Sequence[tuple[Any, ...]],
    jobs: int,
    begin: Callable[[], object] | None = None,
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

    Raises
    ------
    FacertError
        When a process was killed.
    """
    jobs = min(jobs, len(arguments))
    if jobs < 2:
        yield from (function(*each) for each in arguments)
        return
    from joblib import Parallel, delayed

    # An interrupted run is meant to cancel what is under way.
    warnings.filterwarnings("ignore", r"\d+ tasks (which were|have been)", UserWarning)
    pool = Parallel(
        jobs,
        backend="loky",
        return_as="generator_unordered",
        max_nbytes=None,  # arrays as they are: a mapped one cannot be written to
        initializer=_begin_process,
        initargs=(begin, jobs),
    )
    try:
        yield from pool(delayed(function)(*each) for each in arguments)
    except BrokenProcessPool:
        raise FacertError("a process was killed; if for lack of memory, use fewer --jobs") from None


def _begin_process(begin: Callable[[], object] | None, processes: int) -> None:
    """Leave Ctrl-C to the parent, and end with it; take a share of the memory."""
    share_memory(processes)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()
    if begin is not None:
        begin()


def _end_with_parent() -> None:
    """End this process once its parent is gone: a killed parent cannot end it."""
    parent = os.getppid()
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)
