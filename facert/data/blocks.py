"""Large arrays in blocks: what is made on the way then fits into the processor's cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from facert.data.arrays import FloatArray, IntArray

AT_ONCE = 1 << 18
"""Numbers of a block."""
LEAST = 16
"""Rows or columns of a block, at least: memory is read by as many."""


def blocks(count: int, across: int, at_once: int = AT_ONCE) -> Iterator[slice]:
    """Slices of `count` rows or columns, each of which has `across` numbers."""
    width = max(at_once // max(across, 1), LEAST)
    for start in range(0, count, width):
        yield slice(start, min(start + width, count))


def in_blocks(
    work: Callable[[FloatArray], FloatArray], X: FloatArray, across: int, at_once: int = AT_ONCE
) -> FloatArray:
    """What is worked out of each row (n, d), where `across` numbers are made for one on the way."""
    parts = [work(X[rows]) for rows in blocks(len(X), across, at_once)]
    return parts[0] if len(parts) == 1 else np.concatenate([work(X[:0]), *parts])


def spread(count: int, most: int) -> IntArray:
    """The indices of at most so many of `count` things, evenly spread."""
    return np.linspace(0, count - 1, min(most, count)).round().astype(np.int64)
