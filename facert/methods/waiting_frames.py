"""Variances of single frames, worked out together when the first of them is asked for.

The variance of one frame needs every number of an (n, n) matrix: of thousands of labels it takes as
long as that takes to come from memory. For all frames that wait, the matrix comes once.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable

import numpy as np

from facert.data.arrays import FloatArray

MOST = 256  # frames that may wait, forgotten ones among them, before these are struck off

Variances = Callable[[FloatArray, FloatArray], FloatArray]


class WaitingFrames:
    """The frames whose variance may still be asked for: whoever drops the question drops them."""

    def __init__(self) -> None:
        self._frames: list[weakref.ref[_Frame]] = []

    def __reduce__(self) -> tuple[type[WaitingFrames], tuple[()]]:
        """A copy, as for another process, waits for nothing."""
        return WaitingFrames, ()

    def add(
        self, k: FloatArray, squares: FloatArray, variances: Variances
    ) -> Callable[[], FloatArray]:
        """Let a frame wait; what is returned asks for its variances, (p, 1).

        Parameters
        ----------
        k : array, shape (p, 1, n)
            Its kernels.
        squares : array, shape (f, 1, 1)
            Of its features.
        variances : function
            From the kernels (p, T, n) and squares (f, T, 1) of frames to their variances, (p, T).
        """
        if len(self._frames) >= MOST:
            self._frames = [frame for frame in self._frames if frame() is not None]
        added = _Frame(self, k, squares, variances)
        self._frames.append(weakref.ref(added))
        return added

    def answer(self, asked: _Frame) -> None:
        """Work out all that wait, and the one that was asked for."""
        waiting, self._frames = self._frames, []
        frames = [frame for one in waiting if (frame := one()) is not None and frame is not asked]
        frames.append(asked)
        k = np.concatenate([frame.k for frame in frames], axis=1)
        squares = np.concatenate([frame.squares for frame in frames], axis=1)
        found = asked.variances_of(k, squares)
        for number, frame in enumerate(frames):
            frame.variances = found[:, number : number + 1]


class _Frame:
    """A frame that waits; called, it gives its variances (p, 1)."""

    def __init__(
        self, queue: WaitingFrames, k: FloatArray, squares: FloatArray, variances: Variances
    ) -> None:
        self._queue, self.k, self.squares, self.variances_of = queue, k, squares, variances
        self.variances: FloatArray | None = None

    def __call__(self) -> FloatArray:
        if self.variances is None:
            self._queue.answer(self)
        assert self.variances is not None
        return self.variances
