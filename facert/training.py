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
from facert.methods import make_method, method_class
from facert.methods.base import Labelled, Report, Unlabelled
from facert.normalisation import Normalisation
from facert.optim.monitor import Monitor
from facert.posing.known import keep
from facert.retargeter import Retargeter
from facert.settings import LimitRule, Settings
from facert.training_set import TrainingSet, choose_training_set

log = logging.getLogger(__name__)


def train(
    take: Take, settings: Settings | None = None, monitor: Monitor | None = None
) -> Retargeter:
    """Learn to retarget from a take's labels, its other frames, and its animation.

    Parameters
    ----------
    take : Take
        With poses in some frames.
    settings : Settings, optional
        By default a blend of experts, see `facert.methods.blend`.
    monitor : Monitor, optional
        Watches the training; see `facert.gplvm.training`.

    Raises
    ------
    InputError
        When the take has too few labels, or source or poses that never change.
    """
    settings = settings or Settings()
    if settings.unlabelled is None:
        settings = replace(settings, unlabelled=method_class(settings.method).most_unlabelled)
    controls = take.controls
    if controls is None:
        raise InputError("/target", "poses in some frames", "none", "Pose 10 to 40 frames.")
    take = replace(take, source=_observed_part(take.source))
    _warn_of_zeros(take.source)
    data = choose_training_set(take, settings)
    source_units = Normalisation.of(take.source.matrix, f"/source/{take.source.kind}")
    settings = with_noise(settings, source_units.apply(_complete_frames(take.source, data)))
    poses = np.vstack([data.Y_labelled, data.Y_unlabelled])
    target_units = Normalisation.of(poses, "/target/params")
    labelled = Labelled(source_units.apply(data.X_labelled), target_units.apply(data.Y_labelled))
    bounds = _bounds(take, data.Y_labelled, settings.limits)
    unlabelled = Unlabelled(
        source_units.apply(data.X_unlabelled),
        target_units.apply(data.Y_unlabelled),
        target_units.apply(_unlimited(controls) if bounds is None else bounds.T),
    )
    method = make_method(settings)
    began = time.perf_counter()
    report = method.fit(labelled, unlabelled, monitor or Monitor())
    seconds = time.perf_counter() - began
    return Retargeter(
        method=method,
        source_kind=take.source.kind,
        source_names=take.source.names,
        units=take.units,
        controls=controls,
        bounds=bounds,
        source_units=source_units,
        target_units=target_units,
        figures=_figures(report, seconds, labelled),
        poses=keep(data.Y_labelled, take.animation, settings.seed),
    )


def _observed_part(source: Source) -> Source:
    """The source without markers or weights that no frame shows: nothing can be learned of them."""
    seen = np.asarray(source.valid.any(axis=0))
    if seen.all():
        return source
    silent = [name for name, there in zip(source.names, seen, strict=True) if not there]
    log.warning("never observed in the take, left out: %s", ", ".join(silent))
    names = tuple(name for name, there in zip(source.names, seen, strict=True) if there)
    return Source(source.values[:, seen], names)


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


def _warn_of_zeros(source: Source) -> None:
    """Some systems write (0, 0, 0) for a marker that was lost."""
    if source.kind != "markers":
        return
    zeros = int(np.sum(~source.values.any(axis=2)))
    if zeros:
        log.warning("%d marker positions are exactly (0, 0, 0): lost ones should be NaN", zeros)


def _figures(report: Report, seconds: float, labelled: Labelled) -> dict[str, Any]:
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
    return figures | dict(report.figures)
