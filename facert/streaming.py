"""Retargeting live: one frame after the other, with the memory of those before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from facert.adjustments import Adjustments
from facert.cleaning.estimate import LEAST_NOISE
from facert.cleaning.filtering import MotionFilter, NoiseMeter
from facert.cleaning.watching import MarkerWatch
from facert.data import BoolArray, FloatArray
from facert.errors import InputError
from facert.handling import Handling
from facert.neutral import calibrated

if TYPE_CHECKING:
    from facert.retargeter import Retargeter


@dataclass(frozen=True, eq=False)
class Streamed:
    """What became of one frame.

    Parameters
    ----------
    params : array, shape (P,)
        The pose.
    std : array, shape (P,), or None
        Its standard deviation, where the method has one.
    source : array, shape (M, 3) or (D,)
        The cleaned source, in the model's order.
    """

    params: FloatArray
    std: FloatArray | None
    source: FloatArray


class RetargetStream:
    """Maps a source frame by frame; made by `Retargeter.stream`.

    Parameters
    ----------
    retargeter : Retargeter
    names : sequence of str
        Of the source's markers or weights.
    fps : float, optional
        Frames a second; by default that of the training take.
    handling : Handling, optional
        Its neutral frames are not used: see `rest`.
    rest : array, shape of a frame, optional
        The source with the actor at rest.

    Raises
    ------
    InputError
        When the names are not those of the model.
    """

    def __init__(
        self,
        retargeter: Retargeter,
        names: Sequence[str],
        fps: float | None = None,
        handling: Handling | None = None,
        rest: FloatArray | None = None,
    ) -> None:
        handling = handling or Handling()
        if fps is not None and not 0.0 < fps < np.inf:
            raise InputError("fps", "a number above 0", repr(fps), "Give the true rate.")
        self._retargeter = retargeter
        self._places = retargeter.layout.places(names)
        markers = retargeter.layout.kind == "markers"
        self._shape = (len(names), 3) if markers else (len(names),)
        self._watch = MarkerWatch() if handling.detect and markers else None
        self._filter = _filter(retargeter, fps, handling)
        given = handling.sigma is not None
        self._meter = None if given else NoiseMeter(len(retargeter.source_units.mean))
        self._adjustments = handling.adjustments or Adjustments.none(len(retargeter.controls.names))
        self._smooth = retargeter.method.stream()
        self._rough = None if self._adjustments.smooth_all else retargeter.method.stream()
        self._rest = None if rest is None else self._row(self._checked(rest))

    def step(self, values: FloatArray) -> Streamed:
        """Map one more frame; quickest within `facert.threads.threads_for` of one point.

        Parameters
        ----------
        values : array, shape (M, 3) or (D,)
            In the order of the names; NaN: not observed.

        Raises
        ------
        InputError
            For another shape, or numbers that are infinite.
        """
        values = self._checked(values)
        if self._watch is not None:
            values[self._watch.step(values)] = np.nan
        return self._mapped(self._row(values))

    def _checked(self, values: FloatArray) -> FloatArray:
        """A copy of a frame; raises InputError when it is not one."""
        values = np.array(values, dtype=np.float64)
        if values.shape != self._shape or np.isinf(values).any():
            found = "infinite numbers" if values.shape == self._shape else f"{values.shape}"
            raise InputError("the frame", f"numbers of shape {self._shape}", found, "Skip it.")
        return values

    def _row(self, values: FloatArray) -> FloatArray:
        """A frame in the model's order and the source's units, (d_x,)."""
        if values.ndim == 2:
            values = np.where(np.isnan(values).any(axis=1, keepdims=True), np.nan, values)
        return self._places.pick(values[None]).ravel()

    def _mapped(self, row: FloatArray) -> Streamed:
        model, adjust = self._retargeter, self._adjustments
        if self._rest is not None:
            row = calibrated(row[None], self._rest, model.neutral, model.layout.kind)[0]
        frame = model.source_units.apply(row)
        clean, doubt = self._cleaned(frame, ~np.isnan(frame))
        said = self._smooth.step(clean[None], doubt)
        Y = said.Y
        if self._rough is not None:
            measured = np.where(np.isnan(frame), clean, frame)
            Y = adjust.mixed(Y, self._rough.step(measured[None], doubt).Y)
        params, std = model.finished(Y, said.std, adjust)
        source = model.source_units.undo(said.X)[0]
        shape = (-1, 3) if model.layout.kind == "markers" else (-1,)
        return Streamed(params[0], None if std is None else std[0], source.reshape(shape))

    def _cleaned(self, frame: FloatArray, seen: BoolArray) -> tuple[FloatArray, FloatArray | None]:
        if self._filter is None:
            return frame, None
        heard = None if self._meter is None else self._meter.step(frame)
        if heard is not None:
            self._filter.hear(max(heard, LEAST_NOISE))
        mean, variance = self._filter.step(frame)
        return mean, np.where(seen, 0.0, variance)[None]


def _filter(retargeter: Retargeter, fps: float | None, handling: Handling) -> MotionFilter | None:
    """What takes noise out, if it is wanted and the model knows how its source moves."""
    motion = retargeter.motion
    if motion is None or not handling.smooth:
        return None
    sigma = motion.sigma
    if handling.sigma is not None:
        sigma = handling.sigma / retargeter.source_units.scale
    return MotionFilter(motion if fps is None else motion.every(1.0 / fps), sigma)
