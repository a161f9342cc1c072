"""From a take to a trained retargeter: what is learned from, in normalised units."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.data.ranges import parse_frames
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.methods.base import IN_TARGET_UNITS, Labelled, Method, Report, Unlabelled
from facert.methods.noise import with_noise
from facert.methods.registry import method_class
from facert.models.optim.monitor import Monitor
from facert.preprocess.known_poses import keep
from facert.preprocess.neutral import at_rest, most_neutral
from facert.preprocess.preparation import Prepared, prepare
from facert.preprocess.source_layout import SourceLayout
from facert.preprocess.training_set import TrainingSet, choose_training_set
from facert.regions.layout import FaceData, method_for
from facert.regions.resolution import resolved
from facert.retarget.label_checks import check_poses, warn_if_constant
from facert.retarget.retargeter import Retargeter
from facert.settings import LimitRule, Settings

log = logging.getLogger(__name__)


def train(
    take: Take,
    settings: Settings | None = None,
    monitor: Monitor | None = None,
    start: Retargeter | None = None,
) -> Retargeter:
    """Learn to retarget from a take's labels, its other frames, and its animation.

    Parameters
    ----------
    take : Take
        With poses in some frames.
    settings : Settings, optional
        By default those of the start, else a blend of experts, see `facert.methods.blend`.
    monitor : Monitor, optional
        Watches the training; see `facert.models.gplvm.training`.
    start : Retargeter, optional
        What a shared model begins at, as after a label was added to the take that it was trained
        on: frames and poses that it knows keep their latent coordinates, and a few iterations
        do. One of another form is told and not used; other methods learn in one go anyway.

    Raises
    ------
    InputError
        When the take has too few labels, or source or poses that never change.
    """
    if settings is None:
        settings = Settings() if start is None else replace(start.settings, labels=None)
    if settings.unlabelled is None:
        settings = replace(settings, unlabelled=method_class(settings.method).most_unlabelled)
    controls = take.controls
    if controls is None:
        raise InputError("/target", "poses in some frames", "none", "Pose 10 to 40 frames.")
    check_poses(take)
    prepared = prepare(take, settings)
    settings = replace(settings, regions=resolved(settings.regions, take, prepared.take))
    take, source_units = prepared.take, prepared.units
    if settings.sigma_t is None:
        settings = replace(settings, sigma_t=prepared.step)
    data = choose_training_set(take, settings)
    neutral = _neutral(take, data, settings)
    complete = _complete_frames(take.source, data)
    given, settings = settings, with_noise(settings, source_units.apply(complete))
    known = _normalised(take, data, source_units, settings.limits)
    face = FaceData(prepared.measured, controls, known.poses, data.X_labelled, complete)
    method = method_for(settings, given, face)
    if start is not None and method_class(settings.method).stepwise:
        _begin(method, start, _differs(start, settings, take, controls), source_units, known.units)
    began = time.perf_counter()
    report = method.fit(known.labelled, known.unlabelled, monitor or Monitor())
    seconds = time.perf_counter() - began
    warn_if_constant(method, known.frames, known.labelled.Y)
    return Retargeter(
        method=method,
        layout=SourceLayout(take.source.kind, take.source.names),
        units=take.units,
        controls=controls,
        bounds=known.bounds,
        source_units=source_units,
        target_units=known.units,
        figures=_noise_figures(prepared, take.units)
        | _figures(report, seconds, known.labelled, known.units),
        neutral=neutral,
        motion=prepared.motion,
        labelled=data.X_labelled,
        poses=keep(data.Y_labelled, take.animation, settings.seed),
    )


@dataclass(frozen=True, eq=False)
class _Known:
    """What a method is given, in normalised units, and what says which these are.

    Parameters
    ----------
    labelled, unlabelled : Labelled, Unlabelled
    poses : array, shape (n, P)
        All that are known, labels first, in the controls' units.
    bounds : array, shape (P, 2), or None
        What poses are clipped to, in these units.
    units : Normalisation
        Of the poses.
    """

    labelled: Labelled
    unlabelled: Unlabelled
    poses: FloatArray
    bounds: FloatArray | None
    units: Normalisation

    @property
    def frames(self) -> FloatArray:
        """All frames, (n, d_x)."""
        return np.vstack([self.labelled.X, self.unlabelled.X])


def _normalised(
    take: Take, data: TrainingSet, source_units: Normalisation, limits: LimitRule
) -> _Known:
    poses = np.vstack([data.Y_labelled, data.Y_unlabelled])
    units = Normalisation.of(poses, "/target/params")
    bounds = _bounds(take, data.Y_labelled, limits)
    unlimited = np.outer([-np.inf, np.inf], np.ones(poses.shape[1]))
    return _Known(
        Labelled(source_units.apply(data.X_labelled), units.apply(data.Y_labelled)),
        Unlabelled(
            source_units.apply(data.X_unlabelled),
            units.apply(data.Y_unlabelled),
            units.apply(unlimited if bounds is None else bounds.T),
        ),
        poses,
        bounds,
        units,
    )


def _begin(
    method: Method,
    start: Retargeter,
    other: str | None,
    source_units: Normalisation,
    target_units: Normalisation,
) -> None:
    """Let a method begin at a model, in other units, unless something keeps it from that."""
    if other is not None:
        log.warning("training begins anew: the start has another %s", other)
        return
    method.begin_at(
        start.method,
        source_units.seen_from(start.source_units),
        target_units.seen_from(start.target_units),
    )


def _differs(start: Retargeter, settings: Settings, take: Take, controls: Controls) -> str | None:
    """What keeps a model from being the start of one for this take; None if nothing does."""
    forms = {
        "method": (settings.method, start.settings.method),
        "latent_dim": (settings.latent_dim, start.settings.latent_dim),
        "regions": (settings.regions, start.settings.regions),
        "kind of source": (take.source.kind, start.layout.kind),
        "unit of markers": (take.units, start.units),
        "markers or weights": (take.source.names, start.layout.names),
        "controls": (controls.names, start.controls.names),
    }
    return next((what for what, (here, there) in forms.items() if here != there), None)


def _neutral(take: Take, data: TrainingSet, settings: Settings) -> FloatArray:
    """The source with the actor at rest, (d_x,); see `Settings.neutral`."""
    if settings.neutral is None:
        return np.asarray(data.X_labelled[most_neutral(data.Y_labelled)])
    frames = np.array(parse_frames(settings.neutral, "neutral"), dtype=np.int64)
    rest = at_rest(take.source.matrix, frames)
    if np.isnan(rest).any():
        raise InputError("neutral", "frames that show the face", "hidden markers", "Name others.")
    return rest


def _bounds(take: Take, labelled: FloatArray, rule: LimitRule) -> FloatArray | None:
    """What poses are clipped to, (P, 2): declared limits, or the range of all poses allowed.

    These are the poses of the labelled frames (l, P) and all of the animation.
    """
    declared = take.controls.limits if take.controls is not None else None
    if rule == "none":
        return None
    if rule == "declared" or declared is not None:
        return declared
    poses = labelled if take.animation is None else np.vstack([labelled, take.animation])
    return np.stack([poses.min(axis=0), poses.max(axis=0)], axis=1)


def _complete_frames(source: Source, data: TrainingSet) -> FloatArray:
    """Frames that show everything, (n, d); where they are few, the filled ones of the training."""
    complete = source.matrix[~np.isnan(source.matrix).any(axis=1)]
    filled = np.vstack([data.X_labelled, data.X_unlabelled])
    return complete if len(complete) > len(filled) else filled


def _noise_figures(prepared: Prepared, unit: str) -> dict[str, Any]:
    """What was told of noise and motion, in the take's units."""
    if prepared.smoothed is None:
        return {}
    unit = f", {unit}" if unit else ""
    found = prepared.smoothed
    return {f"capture noise{unit}": found.sigma, f"motion a frame{unit}": found.sigma_t}


def _figures(
    report: Report, seconds: float, labelled: Labelled, target_units: Normalisation
) -> dict[str, Any]:
    figures: dict[str, Any] = {
        "labelled frames": len(labelled.X),
        "seconds": seconds,
    }
    result = report.result
    if result is not None:
        figures |= {
            "objective": result.value,
            "gradient norm": result.gradient_norm,
            "iterations": result.iterations,
            "status": result.status,
        }
    unit = target_units.scale  # of errors, so that they compare with what retarget tells
    told = {
        name: value * unit if name.endswith(IN_TARGET_UNITS) else value
        for name, value in report.figures.items()
    }
    return figures | told
