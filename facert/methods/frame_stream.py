"""Maps for single frames, one after the other: `Regression` as a stream.

Of a batch the arithmetic takes the time, of a single frame the calls and the memory they touch. So
a map may have a second form for single frames; and a frame's standard deviation, which nobody may
want, is worked out when somebody asks.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from facert.data.arrays import FloatArray
from facert.methods.base import Prediction
from facert.models.gaussian import Gaussian

if TYPE_CHECKING:
    from facert.methods.regression import Map

Tell = Callable[[], FloatArray]
"""Works out a variance, (d_y,)."""


class FrameMap(Protocol):
    """A `Map` for single frames."""

    def __call__(self, x: FloatArray) -> tuple[FloatArray, Tell | None]:
        """The pose (d_y,) of a complete frame (d_x,), and what tells its variance if anything."""
        ...


class RowByRow:
    """Any map, given one row at a time.

    Parameters
    ----------
    map_ : Map
    """

    def __init__(self, map_: Map) -> None:
        self._map = map_

    def __call__(self, x: FloatArray) -> tuple[FloatArray, Tell | None]:
        """See `FrameMap`."""
        Y, std = self._map(x[None])
        return Y[0], None if std is None else lambda: std[0] ** 2


class FramePrediction(Prediction):
    """What is said of one frame; its standard deviation is worked out on demand.

    Parameters
    ----------
    Y, X : arrays, shapes (1, d_y) and (1, d_x)
        As in `Prediction`.
    tell : callable, or None
        Works out the variance of the pose, (d_y,).
    """

    def __init__(self, Y: FloatArray, X: FloatArray, tell: Tell | None) -> None:
        vars(self).update(Y=Y, X=X, _tell=tell)  # it is frozen

    @cached_property
    def std(self) -> FloatArray | None:
        """Standard deviation of the pose, (1, d_y)."""
        tell: Tell | None = vars(self)["_tell"]
        return None if tell is None else np.sqrt(tell())[None]


class FrameStream:
    """Maps frames one after the other; none is remembered.

    Parameters
    ----------
    frame_map : FrameMap
    gaps : Gaussian
        Tells what a frame does not show.
    response : array, shape (d_x, d_y) or (d_x, 0)
        B, see `facert.methods.regression.Regression`.
    """

    def __init__(self, frame_map: FrameMap, gaps: Gaussian, response: FloatArray) -> None:
        self._map, self._gaps, self._response = frame_map, gaps, response

    def step(self, frame: FloatArray, input_variance: FloatArray | None = None) -> Prediction:
        """Map one more frame (1, d_x); see `facert.methods.base.Method.predict`."""
        frame = frame.copy()  # for who asks for the variance, when it may hold another one
        X = self._gaps.fill(frame)
        pose, tell = self._map(X[0])
        if tell is None:
            return FramePrediction(pose[None], X, None)
        return FramePrediction(pose[None], X, lambda: tell() + self._unsure(frame, input_variance))

    def _unsure(self, frame: FloatArray, input_variance: FloatArray | None) -> FloatArray:
        """Variance of the pose (d_y,) by what the frame did not show."""
        _, variance = self._gaps.fill_for(frame, self._response)
        if input_variance is not None:
            variance += np.nan_to_num(input_variance) @ self._response**2
        return np.asarray(variance[0])
