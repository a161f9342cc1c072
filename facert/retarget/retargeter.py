"""A trained retargeter: from a take to a performance.

This and `facert.retarget.training` are the one path of the data: take, normalised arrays, method,
take. Nothing else normalises, and nothing else undoes it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.data.take import Controls, Source, SourceKind, Take
from facert.errors import InputError, NumericalError
from facert.methods.base import Method
from facert.models.threads import threads_for
from facert.preprocess.faults import without_faults
from facert.preprocess.motion.estimate import FEWEST, estimate_if_it_moves, grid
from facert.preprocess.motion.motion import Motion
from facert.preprocess.neutral import at_rest, calibrated
from facert.preprocess.source_layout import SourceLayout
from facert.retarget.adjustments import Adjustments
from facert.retarget.novelty import WORTH_TELLING, Novelty, Shown
from facert.retarget.options import RetargetOptions
from facert.retarget.stream import ABSURD, RetargetStream
from facert.settings import Settings

log = logging.getLogger(__name__)

# Distances from the training take's mean, in normalised units.
FAR = 5.0
Mode = Literal["offline", "online"]


@dataclass(frozen=True)
class Retargeter:
    """A trained method with all that mapping a take needs.

    Made by `train` or `load`.

    Parameters
    ----------
    method : Method
        Works in normalised units.
    layout : SourceLayout
        What the source must hold.
    units : str
        Of the training take's markers; empty when unknown.
    controls : Controls
        What the result holds.
    bounds : array, shape (P, 2), or None
        What poses are clipped to.
    source_units, target_units : Normalisation
        To normalised units and back.
    figures : dict
        How training went, for people.
    poses : array, shape (n, P), or None
        Poses that the character is known to make, for `facert.posing`.
    motion : Motion or None
        How the source moves, in normalised units, for live streams.
    neutral : array, shape (d_x,)
        The source with the actor at rest, in its units; NaN where it is not known.
    labelled : array, shape (l, d_x), or None
        The source in the posed frames, gaps filled; files of earlier versions lack it.
    """

    method: Method
    layout: SourceLayout
    units: str
    controls: Controls
    bounds: FloatArray | None
    source_units: Normalisation
    target_units: Normalisation
    figures: dict[str, Any]
    neutral: FloatArray
    poses: FloatArray | None = None
    motion: Motion | None = None
    labelled: FloatArray | None = None

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

    def finished(
        self, Y: FloatArray, std: FloatArray | None, adjustments: Adjustments
    ) -> tuple[FloatArray, FloatArray | None]:
        """Parameters and their standard deviation from normalised poses, (T, P) each."""
        params = self.target_units.undo(Y)
        if self.bounds is not None:
            params = np.clip(params, *self.bounds.T)
        spread = None if std is None else std * self.target_units.scale * np.abs(adjustments.gain)
        return adjustments.apply(params), spread

    def without_known(self, take: Take) -> Take:
        """The take without the poses that this was trained on: what is left tells the error."""
        if self.poses is None or take.params is None or take.controls is None:
            return take
        if set(take.controls.names) != set(self.controls.names):
            return take
        if self.figures.get("labelled frames", 0) > len(self.poses):  # not all of them are known
            return replace(take, params=None)
        columns = [take.controls.names.index(name) for name in self.controls.names]
        seen = (take.params[:, None, columns] == self.poses[None]).all(axis=2).any(axis=1)
        return replace(take, params=np.where(seen[:, None], np.nan, take.params))

    @property
    def source_kind(self) -> SourceKind:
        """``"markers"`` or ``"weights"``."""
        return self.layout.kind

    @property
    def source_names(self) -> tuple[str, ...]:
        """Of the markers or weights that the model knows."""
        return self.layout.names

    @property
    def settings(self) -> Settings:
        """What it was trained with, defaults filled in."""
        return self.method.settings

    @property
    def facts(self) -> dict[str, Any]:
        """What the model holds and how it was made, as plain values."""
        return {
            "source_kind": self.source_kind,
            "source_names": list(self.source_names),
            "units": self.units,
            "target_names": list(self.controls.names),
            "settings": self.settings.as_dict(),
            "figures": self.figures,
        }

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write everything to one safetensors file.

        Raises
        ------
        OutputExistsError
            When the file exists and `overwrite` is false.
        """
        from facert.retarget.model_file import save

        save(self, Path(path), overwrite)

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
            log.info("%s", smoothed.told(take.units))
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
