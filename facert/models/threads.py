"""The number of BLAS threads, set for a computation and restored after it.

Below about 500 points one thread is fastest: the matrices are too small to share, and on a busy
machine two threads have been measured ten times slower than one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cache

from threadpoolctl import ThreadpoolController

SMALL = 500  # points; up to this size one thread is used


@cache
def _controller(with_torch: bool) -> ThreadpoolController:  # noqa: ARG001  one with, one without
    # Finding the loaded libraries takes milliseconds.
    return ThreadpoolController()


def _torch_is_here() -> bool:
    # Importing it takes seconds, and most methods do without.
    return "torch" in sys.modules


@contextmanager
def _one_torch_thread() -> Iterator[None]:
    if not _torch_is_here():
        yield
        return
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def one_thread() -> Iterator[None]:
    """Run the block with one thread."""
    with _controller(_torch_is_here()).limit(limits=1), _one_torch_thread():
        yield


@contextmanager
def threads_for(points: int) -> Iterator[None]:
    """Run the block with one thread when the matrices have at most `SMALL` rows."""
    with nullcontext() if points > SMALL else one_thread():
        yield
