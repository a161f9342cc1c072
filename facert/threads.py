"""The number of BLAS threads, set for a computation and restored after it.

Below about 500 points one thread is fastest: the matrices are too small to share, and on a busy
machine two threads have been measured ten times slower than one.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import torch
from threadpoolctl import ThreadpoolController

SMALL = 500  # points; up to this size one thread is used


@cache
def _controller() -> ThreadpoolController:
    # Finding the loaded libraries takes milliseconds: once a process is enough.
    return ThreadpoolController()


@contextmanager
def threads_for(points: int) -> Iterator[None]:
    """Run the block with one thread when the matrices have at most `SMALL` rows."""
    if points > SMALL:
        yield
        return
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with _controller().limit(limits=1):
            yield
    finally:
        torch.set_num_threads(before)
