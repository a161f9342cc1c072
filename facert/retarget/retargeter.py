"""A trained retargeter: from a take to a performance.

This and `facert.retarget.training` are the one path of the data: take, normalised arrays, method,
take. Nothing else normalises, and nothing else undoes it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import Source, Take
from facert.errors import InputError, NumericalError
from facert.models.threads import threads_for
from facert.preprocess.faults import without_faults
from facert.preprocess.motion.estimate import FEWEST, estimate_if_it_moves, grid
from facert.preprocess.neutral import at_rest, calibrated
from facert.retarget.adjustments import Adjustments
from facert.retarget.model import TrainedModel
from facert.retarget.model_file import read_model, write_model
from facert.retarget.novelty import WORTH_TELLING, Novelty, Shown
from facert.retarget.options import RetargetOptions
from facert.retarget.stream import ABSURD, RetargetStream

log = logging.getLogger(__name__)

# Distances from the training take's mean, in normalised units.
FAR = 5.0
Mode = Literal["offline", "online"]


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
            All frames at once, cleaned by what those before and after tell; or one after the
            other, as a live stream would be.
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
        """
        options = options or RetargetOptions()
        if mode not in get_args(Mode):
            raise InputError("mode", "offline or online", repr(mode), "Choose one of these.")
        if self.units and take.units and self.units != take.units:
            raise InputError("units", self.units, take.units, "Convert the take to these units.")
        self.layout.require_kind(take.source.kind)
        if options.neutral is not None and self.settings.neutral is None:
            log.warning(
                "the model does not know the actor at rest and takes the smallest pose for it: "
                "name such frames in training as well"
            )
        there = replace(self, method=self.method.on(device))
        try:
            if mode == "online":
                return self._one_by_one(take, options)
            return there._together(take, options)
        except (np.linalg.LinAlgError, OverflowError):
            raise NumericalError("the model's numbers are too large or small to map with") from None

    def stream(
        self,
        names: Sequence[str],
        fps: float | None = None,
        options: RetargetOptions | None = None,
        rest: FloatArray | None = None,
    ) -> RetargetStream:
        """Begin to retarget a live source; see `RetargetStream`."""
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
        """All frames at once: smoothed over time, then mapped in one batch."""
        observed = without_faults(take) if options.detect else take
        source = self.layout.arrange(observed.source)
        X = source.matrix
        if options.neutral is not None:
            rest = at_rest(X, np.asarray(options.neutral, dtype=np.int64))
            X = calibrated(X, rest, self.neutral, self.layout.kind)
        measured = self.source_units.apply(X)
        _check_distance(measured)
        smoothed = None
        if options.smooth:
            smoothed = estimate_if_it_moves(X, take.time, options.sigma)
        adjust = options.adjustments or Adjustments.none(len(self.controls.names))
        if smoothed is None:
            said, std_x = self.method.predict(measured), None
        else:
            log.info("%s", smoothed.summary(take.units))
            clean, std_x = self.source_units.apply(smoothed.frames), smoothed.std
            input_variance = np.where(np.isnan(X), smoothed.std / self.source_units.scale, 0.0) ** 2
            said = self.method.predict(clean, input_variance)
            if not adjust.smooth_all:
                rough = self.method.predict(np.where(np.isnan(X), clean, measured), input_variance)
                said = replace(said, Y=adjust.mixed(said.Y, rough.Y))
        if len(said.X) >= FEWEST:  # of single frames there is nothing to tell in shares
            self._tell_what_is_new(said.X)
        params, std = self.finished(said.Y, said.std, adjust)
        cleaned = source.with_matrix(self.source_units.undo(said.X), std_x)
        return self._performance(take, cleaned, params, std)

    def _one_by_one(self, take: Take, options: RetargetOptions) -> Take:
        """One frame after the other, as they would come live."""
        values, rest = take.source.values, None
        observed = without_faults(take).source if options.detect else take.source
        X = self.layout.arrange(observed).matrix
        if options.neutral is not None:
            frames = np.asarray(options.neutral, dtype=np.int64)
            rest = at_rest(observed.matrix, frames).reshape(values.shape[1:])
            own = at_rest(X, frames)
            X = calibrated(X, own, self.neutral, self.layout.kind)
        _check_distance(self.source_units.apply(X))
        stream = self.stream(take.source.names, 1.0 / grid(take.time)[1], options, rest)
        with threads_for(1):
            steps = [stream.step(frame).complete() for frame in values]
        stds = [step.std for step in steps if step.std is not None]
        return self._performance(
            take,
            Source(np.array([step.source for step in steps]), self.layout.names),
            np.array([step.params for step in steps]),
            np.array(stds) if stds else None,
        )

    def _tell_what_is_new(self, frames: FloatArray) -> None:
        """Warn of cleaned, normalised frames (T, d_x) that are like no posed one."""
        if self.labelled is None or not len(self.labelled):
            return
        shown = Shown.by(self.source_units.apply(self.labelled), self.motion)
        novelty = Novelty.of(shown.left(frames, self.layout.kind), self.layout.names)
        if novelty.share >= WORTH_TELLING:
            log.warning("%s", novelty)

    def _performance(
        self, take: Take, source: Source, params: FloatArray, std: FloatArray | None
    ) -> Take:
        return replace(
            take, source=source, controls=self.controls, params=params, std=std, animation=None
        )


def _check_distance(frames: FloatArray) -> None:
    """Frames in normalised units should be a few units from zero at most.

    Raises
    ------
    InputError
        When they are so far that nothing can be computed.
    """
    distance = float(np.nanmax(np.abs(frames)))
    if distance > ABSURD:
        raise InputError(
            "/source",
            "positions near those of the training take",
            f"{distance:.1e} times its largest deviation away",
            "Check units and origin.",
        )
    if float(np.nanmedian(np.abs(frames))) > FAR:
        log.warning("the source lies far from the training take: check units and head motion")


def load(path: str | Path) -> Retargeter:
    """Read a retargeter from a model file.

    Raises
    ------
    InputError
        When the file is missing, damaged, not a model, or does not fit together.
    """
    return read_model(Path(path), Retargeter)
