"""Retargeting live: one frame after the other, with the memory of those before."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from facert.data.arrays import FloatArray
from facert.errors import InputError
from facert.methods.base import Prediction
from facert.preprocess.clean_source import ABSURD
from facert.preprocess.faults import FaultDetector, Reach
from facert.preprocess.motion.estimate import LEAST_NOISE
from facert.preprocess.motion.filtering import MotionFilter, NoiseMeter, Seen
from facert.preprocess.neutral import Calibration
from facert.preprocess.source_layout import SourceColumns
from facert.retarget.finite import mapping, require_finite
from facert.retarget.model import TrainedModel
from facert.retarget.options import Adjustments, PoseScale, RetargetOptions

log = logging.getLogger("facert")

Details = Callable[[], tuple[FloatArray | None, FloatArray]]
"""Works out the standard deviation of a pose, and the cleaned source."""


class Streamed:
    """One mapped frame.

    Parameters
    ----------
    params : array, shape (P,)
        The pose.
    details : callable
        Works out `std` and `source` when somebody asks: who wants the pose at once does not.
    """

    def __init__(self, params: FloatArray, details: Details) -> None:
        self.params = params
        self._details: Details | None = details
        self._std: FloatArray | None = None
        self._source = np.zeros(0)

    def complete(self) -> Streamed:
        """Compute everything that is pending, and return the frame itself."""
        if self._details is not None:
            self._std, self._source = self._details()
            self._details = None
        return self

    @property
    def std(self) -> FloatArray | None:
        """Standard deviation of the pose, (P,), where the method has one."""
        return self.complete()._std

    @property
    def source(self) -> FloatArray:
        """The cleaned source, (M, 3) or (D,), in the model's order."""
        return self.complete()._source


class RetargetStream:
    """Maps a source frame by frame; made by `Retargeter.stream`.

    Parameters
    ----------
    model : TrainedModel
    names : sequence of str or SourceColumns
        Names of the source's markers or weights, or where the model's are among them.
    fps : float, optional
        Frames a second; by default that of the training take.
    options : RetargetOptions, optional
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
        model: TrainedModel,
        names: Sequence[str] | SourceColumns,
        fps: float | None = None,
        options: RetargetOptions | None = None,
        rest: FloatArray | None = None,
    ) -> None:
        options = options or RetargetOptions()
        if fps is not None and not 0.0 < fps < np.inf:
            raise InputError("fps", "a number above 0", repr(fps), "Give the true rate.")
        markers = model.layout.kind == "markers"
        self._model = model
        self._columns = names if isinstance(names, SourceColumns) else model.layout.columns(names)
        count = self._columns.count
        self._shape = (count, 3) if markers else (count,)
        self._cleaned_shape = (-1, 3) if markers else (-1,)
        self._watch = FaultDetector(count) if options.detect and markers else None
        self._reach = Reach.of(model.source_units, model.layout.kind) if options.detect else None
        self._far: set[str] = set()  # names that the log has warned of
        self._new_filter = partial(_filter, model, fps, options)
        self._filter = self._new_filter()
        self._noise: float | None = None
        given = self._filter is None or options.sigma is not None
        self._meter = None if given else NoiseMeter(len(model.source_units.mean))
        self._pending: FloatArray | None = None
        self._adjustments = options.adjustments or Adjustments.none(len(model.controls.names))
        self._scale = PoseScale(model.target_units, model.bounds, self._adjustments)
        self._smooth = model.method.stream()
        self._rough = None if self._adjustments.smooth_all else model.method.stream()
        self._calibration: Calibration | None = None
        if rest is not None:
            self.calibrate(rest)

    def calibrate(self, rest: FloatArray) -> None:
        """Calibrate to the actor at rest, from the next frame on.

        Parameters
        ----------
        rest : array, shape of a frame
            The source with the actor at rest; NaN where that is not known.
        """
        own, model = self._columns.pick(self._checked(rest).ravel()), self._model
        self._calibration = Calibration.of(own, model.neutral, model.layout.kind)
        self._filter = self._new_filter()  # what it knows is where the face was
        if self._filter is not None and self._noise is not None:
            self._filter.set_noise(self._noise)

    def prepare(self) -> None:
        """Compute in advance all that need not wait for the next frame; else `step` does it."""
        if self._filter is None:
            return
        if self._meter is not None and self._pending is not None:
            sigma, self._pending = self._meter.step(self._pending), None
            if sigma is not None:
                self._noise = max(sigma, LEAST_NOISE)
                self._filter.set_noise(self._noise)
        self._filter.look_ahead()

    def step(self, values: FloatArray) -> Streamed:
        """Map one more frame; quickest within `facert.models.threads.threads_for` of one point.

        Parameters
        ----------
        values : array, shape (M, 3) or (D,)
            In the order of the names; NaN: not observed.

        Raises
        ------
        InputError
            For another shape, or numbers that are infinite.
        NumericalError
            When the model's numbers give no finite pose.
        """
        with mapping():
            return self._step(self._checked(values))

    def _step(self, values: FloatArray) -> Streamed:
        self.prepare()
        row, seen = self._observed(values)
        if self._calibration is not None:
            row = self._calibration.apply(row)
        frame, seen = self._within_reach(self._model.source_units.apply(row), seen)
        if (np.abs(frame) > ABSURD).any():  # never where NaN
            expected, found = "positions near those of the training take", "others, far away"
            raise InputError("the frame", expected, found, "Skip it; check units and origin.")
        clean, input_variance = self._cleaned(frame, seen)
        predicted = self._smooth.step(clean[None], input_variance)
        Y = predicted.Y
        if self._rough is not None:
            measured = frame if seen is None else np.where(seen, frame, clean)
            Y = self._adjustments.mixed(Y, self._rough.step(measured[None], input_variance).Y)
        params = self._scale.params(Y[0])
        require_finite(Y, params)
        return Streamed(params, lambda: self._completed(predicted))

    def _checked(self, values: FloatArray) -> FloatArray:
        """A frame as an array; raises InputError when it is not one."""
        values = np.asarray(values, dtype=np.float64)
        if values.shape != self._shape or np.isinf(values).any():
            found = "infinite numbers" if values.shape == self._shape else f"{values.shape}"
            raise InputError("the frame", f"numbers of shape {self._shape}", found, "Skip it.")
        return values

    def _observed(self, values: FloatArray) -> tuple[FloatArray, Seen]:
        """A frame in the model's order and the source's units, (d_x,), and what it shows."""
        if self._watch is not None:
            bad = self._watch.step(values)
            if bad.any():
                values = np.where(bad[:, None], np.nan, values)
        row = self._columns.pick(values.ravel())
        hidden = np.isnan(row)
        if not hidden.any():
            return row, None
        if values.ndim == 2:  # what hides one of its coordinates hides a marker
            hidden = np.repeat(hidden.reshape(-1, 3).any(axis=1), 3)
            row[hidden] = np.nan
        return row, ~hidden

    def _within_reach(self, frame: FloatArray, seen: Seen) -> tuple[FloatArray, Seen]:
        """A normalised frame without what is far beyond training, and what it shows then."""
        far = None if self._reach is None else self._reach.beyond(frame[None])
        if far is None:
            return frame, seen
        layout = self._model.layout
        for index in np.flatnonzero(far[0, :: layout.width]):
            name = layout.names[index]
            if name not in self._far:
                self._far.add(name)
                text = "%s is far beyond all that the training take showed: taken as not observed"
                log.warning(text, name)
        frame = np.where(far[0], np.nan, frame)
        return frame, ~np.isnan(frame)

    def _cleaned(self, frame: FloatArray, seen: Seen) -> tuple[FloatArray, FloatArray | None]:
        """The frame without noise, (d_x,), and the variance of what it did not show, (1, d_x)."""
        if self._filter is None:
            return frame, None
        self._pending = frame
        mean = self._filter.step(frame, seen)
        return mean, None if seen is None else np.where(seen, 0.0, self._filter.variance)[None]

    def _completed(self, predicted: Prediction) -> tuple[FloatArray | None, FloatArray]:
        """Standard deviation of the pose, and the cleaned source."""
        with mapping():
            source = self._model.source_units.undo(predicted.X[0])
            std = None if predicted.std is None else self._scale.std(predicted.std[0])
            require_finite(std)
            return std, source.reshape(self._cleaned_shape)


def _filter(
    model: TrainedModel, fps: float | None, options: RetargetOptions
) -> MotionFilter | None:
    """The filter of the source; None if it is not wanted, or the model has no motion."""
    motion = model.motion
    if motion is None or not options.smooth:
        return None
    sigma = motion.sigma
    if options.sigma is not None:
        sigma = options.sigma / model.source_units.scale
    return MotionFilter(motion if fps is None else motion.every(1.0 / fps), sigma)
