"""A trained retargeter: from a take to a performance.

What a model is given is normalised by the units that `facert.retarget.training` found, and what it
predicts is brought back by them, here and in `facert.retarget.stream` alone. (Parts of the
mathematics have units of their own inside: the motion of a source, regions, stages of a search.)
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from facert.data.arrays import FloatArray, frozen
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.methods.base import Method, Prediction
from facert.models.threads import threads_for
from facert.preprocess.clean_source import clean_source
from facert.preprocess.motion.estimate import FEWEST
from facert.preprocess.motion.series import even_grid
from facert.preprocess.source_layout import SourceColumns
from facert.retarget.finite import mapping, require_finite
from facert.retarget.model import TrainedModel
from facert.retarget.model_file import read_model, write_model
from facert.retarget.novelty import novelty_warning
from facert.retarget.options import Adjustments, PoseScale, RetargetOptions
from facert.retarget.source_reasons import unlike
from facert.retarget.stream import RetargetStream

log = logging.getLogger(__name__)

Mode = Literal["offline", "online"]
PART = 2**14
"""Frames that are mapped at a time: what that takes beside the result is bounded."""
TOGETHER = 64
"""Frames that are mapped one after the other before their standard deviations are asked for."""
JUDGED = {"judged": True}
"""The mark of lines of the log that a verdict repeats."""


@dataclass(frozen=True)
class Retargeter(TrainedModel):
    """A trained model that maps takes and live sources; made by `train` or `load`."""

    def retarget(
        self,
        take: Take,
        mode: Mode = "offline",
        options: RetargetOptions | None = None,
        device: str = "cpu",
    ) -> Take:
        """The take with a pose in every frame, and a cleaned source.

        Where the method has one, each pose comes with its standard deviation.

        Parameters
        ----------
        take : Take
            Its source must hold this retargeter's markers or weights, in any order; NaN is
            mapped as not observed.
        mode : {"offline", "online"}
            All frames at once, cleaned by those before and after; or one after the other, as a
            live stream would be.
        options : RetargetOptions, optional
            What is done about bad markers, noise, the actor's rest and single controls.
        device : str
            Where the shared models map all frames at once: ``"cpu"`` or ``"cuda"``. One after the
            other they are mapped on the CPU.

        Raises
        ------
        DeviceError
            When the device is not there.
        InputError
            When the source is of another kind or lacks names that the model needs.
        NumericalError
            When the model's numbers give no finite poses.
        """
        options = options or RetargetOptions()
        if mode not in get_args(Mode):
            raise InputError("mode", "offline or online", repr(mode), "Choose one of these.")
        if self.units and take.units and self.units != take.units:
            raise InputError("units", self.units, take.units, "Convert the take to these units.")
        if options.neutral is not None and self.settings.neutral is None:
            log.warning(
                "the model does not know the actor at rest and takes the smallest pose for it: "
                "name such frames in training as well"
            )
        there = self if device == "cpu" else replace(self, method=self.method.on(device))
        with mapping():
            if mode == "online":
                return self._one_by_one(take, options)
            return there._together(take, options)

    def stream(
        self,
        names: Sequence[str] | SourceColumns,
        fps: float | None = None,
        options: RetargetOptions | None = None,
        rest: FloatArray | None = None,
    ) -> RetargetStream:
        """A stream that retargets a live source; see `RetargetStream`."""
        return RetargetStream(self, names, fps, options, rest)

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write everything to one safetensors file.

        Raises
        ------
        OutputExistsError
            When the file exists and `overwrite` is false.
        """
        write_model(self, Path(path), overwrite)

    def _together(self, take: Take, options: RetargetOptions) -> Take:
        """Map all frames at once: smoothed over time, then in one batch."""
        found = clean_source(take, self.layout, self.source_units, self.neutral, options)
        adjust = options.adjustments or Adjustments.none(len(self.controls.names))
        predicted = _in_parts(self.method, found.clean, found.input_variance)
        if found.std is not None and not adjust.smooth_all:
            rough = _in_parts(self.method, found.filled, found.input_variance)
            predicted = replace(predicted, Y=adjust.mixed(predicted.Y, rough.Y))
        seen, deviations = found.source, found.std
        del found  # of a long take the rest is several times as large
        if len(predicted.X) >= FEWEST:  # shares of single frames mean nothing
            self._warn_of_novelty(predicted.X)
        scale = PoseScale(self.target_units, self.bounds, adjust)
        params, std = scale.params(predicted.Y), scale.std(predicted.std)
        require_finite(predicted.Y, params, std)
        cleaned = frozen(self.source_units.undo(predicted.X))
        source = seen.with_matrix(cleaned, deviations)
        for poses in (params, std):
            if poses is not None:
                frozen(poses)  # the take holds them as they are
        return self._performance(take, source, params, std)

    def _one_by_one(self, take: Take, options: RetargetOptions) -> Take:
        """Map one frame after the other, as they would come live."""
        whole = replace(options, smooth=False)  # what is looked at beforehand is not smoothed
        rest = clean_source(take, self.layout, self.source_units, self.neutral, whole).rest
        columns = self.layout.columns(take.source.names, quiet=True)  # cleaning logged it
        stream = self.stream(columns, 1.0 / even_grid(take.time)[1], options, rest)
        frames, steps = take.source.values, []
        with threads_for(1):
            for first in range(0, len(frames), TOGETHER):
                made = [stream.step(frame) for frame in frames[first : first + TOGETHER]]
                steps += [step.complete() for step in made]
        stds = [step.std for step in steps if step.std is not None]
        return self._performance(
            take,
            Source(np.array([step.source for step in steps]), self.layout.names),
            np.array([step.params for step in steps]),
            np.array(stds) if stds else None,
        )

    def _warn_of_novelty(self, frames: FloatArray) -> None:
        """Warn of cleaned, normalised frames (T, d_x) that are like no posed one, by the cause.

        Who judges the result afterwards says all of that: such lines are marked.
        """
        found = unlike(frames, self)
        if found is None:
            return
        for cause in (found.head_warning, found.placed_warning):
            if cause:
                log.warning("%s", cause, extra=JUDGED)
        warning = novelty_warning(found.left, self.layout.names)
        if warning is not None:
            log.warning("%s", warning, extra=JUDGED)

    def _performance(
        self, take: Take, source: Source, params: FloatArray, std: FloatArray | None
    ) -> Take:
        return replace(
            take,
            source=source,
            controls=self.controls,
            params=params,
            std=std,
            animation=None,
            corrections=None,
            model=self.description,
        )


def _in_parts(method: Method, frames: FloatArray, variance: FloatArray | None) -> Prediction:
    """What a method predicts for frames (T, d_x), each on its own; see `Method.predict`."""
    if len(frames) <= PART:
        return method.predict(frames, variance)
    starts = range(0, len(frames), PART)
    rows = [slice(start, start + PART) for start in starts]
    parts = [method.predict(frames[r], None if variance is None else variance[r]) for r in rows]
    stds = [part.std for part in parts if part.std is not None]
    return Prediction(
        np.concatenate([part.Y for part in parts]),
        np.concatenate(stds) if stds else None,
        np.concatenate([part.X for part in parts]),
    )


def load(path: str | Path) -> Retargeter:
    """Read a retargeter from a model file.

    Raises
    ------
    InputError
        When the file is missing, damaged, not a model, or does not fit together.
    """
    return read_model(Path(path), Retargeter)
