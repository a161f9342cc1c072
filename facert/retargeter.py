"""A trained retargeter: from a take to a performance, and to a model file and back.

This and `facert.training` are the one path of the data: take, normalised arrays, method, take.
Nothing else normalises, and nothing else undoes it.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

import facert
from facert.data import Controls, FloatArray, Source, SourceKind, Take
from facert.errors import InputError, NumericalError, reading
from facert.io.tensors import read_tensors, write_tensors
from facert.methods import make_method
from facert.methods.base import (
    Method,
    Prediction,
    stack_predictions,
)
from facert.names import NameIndex, match
from facert.normalisation import Normalisation
from facert.settings import Settings
from facert.threads import threads_for

log = logging.getLogger(__name__)

FORMAT = "facert-model"
# Distances from the training take's mean, in normalised units.
FAR, ABSURD = 5.0, 1e6
Mode = Literal["offline", "online"]


@dataclass(frozen=True)
class Retargeter:
    """A trained method with all that mapping a take needs.

    Made by `train` or `load`.

    Parameters
    ----------
    method : Method
        Works in normalised units.
    source_kind, source_names : str, tuple of str
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
    """

    method: Method
    source_kind: SourceKind
    source_names: tuple[str, ...]
    units: str
    controls: Controls
    bounds: FloatArray | None
    source_units: Normalisation
    target_units: Normalisation
    figures: dict[str, Any]
    poses: FloatArray | None = None

    def retarget(self, take: Take, mode: Mode = "offline") -> Take:
        """The take with a pose in every frame, and a cleaned source.

        Where the method has one, each pose comes with its standard deviation.

        Parameters
        ----------
        take : Take
            Its source must hold this retargeter's markers or weights, in any order; NaN is
            mapped as not observed.
        mode : {"offline", "online"}
            All frames at once, each on its own; or one after the other with the temporal term,
            as a live stream would be.

        Raises
        ------
        InputError
            When the source is of another kind or lacks names that the model needs.
        """
        if mode not in get_args(Mode):
            raise InputError("mode", "offline or online", repr(mode), "Choose one of these.")
        if self.units and take.units and self.units != take.units:
            raise InputError("units", self.units, take.units, "Convert the take to these units.")
        source = self._matched(take.source)
        frames = self.source_units.apply(source.matrix)
        _check_distance(frames)
        try:
            prediction = self._predict(frames, mode)
        except (np.linalg.LinAlgError, OverflowError):
            raise NumericalError("the model's numbers are too large or small to map with") from None
        params = self.target_units.undo(prediction.Y)
        if self.bounds is not None:
            params = np.clip(params, *self.bounds.T)
        return replace(
            take,
            source=source.with_matrix(self.source_units.undo(prediction.X)),
            controls=self.controls,
            params=params,
            std=None if prediction.std is None else prediction.std * self.target_units.scale,
            animation=None,
        )

    def without_known(self, take: Take) -> Take:
        """The take without the poses that this was trained on: what is left tells the error."""
        if self.poses is None or take.params is None or take.controls is None:
            return take
        if set(take.controls.names) != set(self.controls.names):
            return take
        columns = [take.controls.names.index(name) for name in self.controls.names]
        seen = (take.params[:, None, columns] == self.poses[None]).all(axis=2).any(axis=1)
        return replace(take, params=np.where(seen[:, None], np.nan, take.params))

    def _predict(self, frames: FloatArray, mode: Mode) -> Prediction:
        if mode == "offline":
            return self.method.predict(frames)
        stream = self.method.stream()
        with threads_for(1):
            return stack_predictions([stream.step(frame[None]) for frame in frames])

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
        arrays = {f"method.{name}": array for name, array in self.method.save().items()}
        for view, units in (("source", self.source_units), ("target", self.target_units)):
            arrays[f"{view}.mean"] = units.mean
            arrays[f"{view}.scale"] = np.array([units.scale])
        if self.controls.limits is not None:
            arrays["target.limits"] = self.controls.limits
        if self.bounds is not None:
            arrays["target.bounds"] = self.bounds
        if self.poses is not None:
            arrays["target.poses"] = self.poses
        metadata = {
            "format": FORMAT,
            "format_version": 1,
            "created_by": f"facert {facert.__version__}",
            "versions": library_versions(),
            **self.facts,
        }
        write_tensors(Path(path), arrays, metadata, overwrite)

    def _matched(self, source: Source) -> Source:
        """The source's columns in the order the model knows them.

        A marker that the take lacks is one that was not observed: the job goes on, with a warning.
        Where the take has unknown names instead, or lacks most, it is misspelt or another set.
        """
        if source.kind != self.source_kind:
            raise InputError(
                "/source",
                self.source_kind,
                source.kind,
                "Give a take of the kind it was trained on.",
            )
        index = NameIndex(source.names)
        absent = [name for name in self.source_names if index.find(name) is None]
        present = [name for name in self.source_names if index.find(name) is not None]
        extra = len(source.names) - len(present)
        if absent and (extra or len(absent) > len(present)):
            match(absent, source.names, "/source/names")  # tells which, and the nearest name
        columns = match(present, source.names, "/source/names")
        if absent:
            log.warning("taken as not observed, as the take lacks them: %s", ", ".join(absent))
        if extra:
            log.info("%d names of the source are not in the model: passed over", extra)
        values = np.full(
            (len(source.values), len(self.source_names), *source.values.shape[2:]), np.nan
        )
        values[:, [self.source_names.index(name) for name in present]] = source.values[:, columns]
        return Source(values, self.source_names)


def load(path: str | Path) -> Retargeter:
    """Read a retargeter from a model file.

    Raises
    ------
    InputError
        When the file is missing, damaged, not a model, or does not fit together.
    """
    arrays, metadata = read_tensors(Path(path), FORMAT)
    with reading(path):
        try:
            settings = Settings().with_changes(metadata["settings"])
            kind, names = metadata["source_kind"], tuple(map(str, metadata["source_names"]))
            controls = Controls(tuple(metadata["target_names"]), arrays.get("target.limits"))
            bounds = Controls(controls.names, arrays.get("target.bounds")).limits
            source_units, target_units = (
                Normalisation(arrays[f"{view}.mean"], float(arrays[f"{view}.scale"].item()))
                for view in ("source", "target")
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                "the metadata", "a complete model", f"{error!r}", "Train the model again."
            ) from None
        method = make_method(settings)
        method.load(
            {n.removeprefix("method."): a for n, a in arrays.items() if n.startswith("method.")}
        )
        retargeter = Retargeter(
            method,
            kind,
            names,
            str(metadata.get("units", "")),
            controls,
            bounds,
            source_units,
            target_units,
            dict(metadata.get("figures", {})),
            arrays.get("target.poses"),
        )
        _check_fit(retargeter, arrays)
    return retargeter


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


def library_versions() -> dict[str, str]:
    """Versions of what computed a result, for its metadata."""
    return {name: version(name) for name in ("facert", "torch", "numpy", "scipy")}


def _check_fit(retargeter: Retargeter, arrays: Mapping[str, FloatArray]) -> None:
    """Refuse a file whose parts disagree: mapping would fail, or worse, not fail."""
    kind, names = retargeter.source_kind, retargeter.source_names
    if kind not in get_args(SourceKind):
        raise _misfit("source_kind", "markers or weights", repr(kind))
    if len(set(names)) < len(names):
        raise _misfit("source_names", "names that are all different", "one of them twice")
    _check_poses(retargeter.poses, len(retargeter.controls.names))
    columns = len(names) * (3 if kind == "markers" else 1), len(retargeter.controls.names)
    for view, count, learned in zip(
        ("source", "target"), columns, retargeter.method.dimensions, strict=True
    ):
        mean, scale = arrays[f"{view}.mean"], arrays[f"{view}.scale"]
        if mean.shape != (count,):
            raise _misfit(f"{view}.mean", f"{count} numbers", f"shape {mean.shape}")
        if learned != count:
            raise _misfit(f"{view}.observations", f"{count} columns", f"{learned}")
        if not scale.item() > 0.0:
            raise _misfit(f"{view}.scale", "a number above 0", f"{scale.item()}")


def _check_poses(poses: FloatArray | None, controls: int) -> None:
    """A file of an earlier version has none."""
    if poses is not None and (poses.ndim != 2 or poses.shape[1] != controls):
        raise _misfit("target.poses", f"{controls} columns", f"shape {poses.shape}")


def _misfit(field: str, expected: str, found: str) -> InputError:
    return InputError(field, expected, found, "Train the model again.")
