"""From a take to a trained retargeter: what is learned from, in normalised units."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from typing import Any

import numpy as np

from facert.data import Controls, FloatArray, Source, Take
from facert.errors import InputError
from facert.gplvm.noise import with_noise
from facert.methods import method_class
from facert.methods.base import IN_TARGET_UNITS, Labelled, Report, Unlabelled
from facert.neutral import at_rest, most_neutral
from facert.normalisation import Normalisation
from facert.optim.monitor import Monitor
from facert.posing.known import keep
from facert.preparation import Prepared, prepare
from facert.ranges import parse_frames
from facert.regions.layout import FaceData, method_for
from facert.regions.resolution import resolved
from facert.retargeter import Retargeter
from facert.sanity import check_poses, warn_if_constant
from facert.settings import LimitRule, Settings
from facert.source_layout import SourceLayout
from facert.training_set import TrainingSet, choose_training_set

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
        Watches the training; see `facert.gplvm.training`.
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
    poses = np.vstack([data.Y_labelled, data.Y_unlabelled])
    target_units = Normalisation.of(poses, "/target/params")
    labelled = Labelled(source_units.apply(data.X_labelled), target_units.apply(data.Y_labelled))
    bounds = _bounds(take, data.Y_labelled, settings.limits)
    unlabelled = Unlabelled(
        source_units.apply(data.X_unlabelled),
        target_units.apply(data.Y_unlabelled),
        target_units.apply(_unlimited(controls) if bounds is None else bounds.T),
    )
    face = FaceData(prepared.measured, controls, poses, data.X_labelled, complete)
    method = method_for(settings, given, face)
    if start is not None and method_class(settings.method).stepwise:
        other = _differs(start, settings, take, controls)
        if other is None:
            method.begin_at(
                start.method,
                source_units.seen_from(start.source_units),
                target_units.seen_from(start.target_units),
            )
        else:
            log.warning("training begins anew: the start has another %s", other)
    began = time.perf_counter()
    report = method.fit(labelled, unlabelled, monitor or Monitor())
    seconds = time.perf_counter() - began
    warn_if_constant(method, np.vstack([labelled.X, unlabelled.X]), labelled.Y)
    return Retargeter(
        method=method,
        layout=SourceLayout(take.source.kind, take.source.names),
        units=take.units,
        controls=controls,
        bounds=bounds,
        source_units=source_units,
        target_units=target_units,
        figures=_noise_figures(prepared, take.units)
        | _figures(report, seconds, labelled, target_units),
        neutral=neutral,
        motion=prepared.motion,
        labelled=data.X_labelled,
        poses=keep(data.Y_labelled, take.animation, settings.seed),
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


def _unlimited(controls: Controls) -> FloatArray:
    """Bounds (2, P) that hold nothing back."""
    return np.outer([-np.inf, np.inf], np.ones(len(controls.names)))


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
