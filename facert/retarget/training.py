"""Training of a retargeter on takes."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from facert.data.columns import warn_of_clocks
from facert.data.labelling import predicted_poses, without_predicted
from facert.data.matching_takes import as_takes
from facert.data.normalisation import Normalisation
from facert.data.subject import about
from facert.data.take import Take
from facert.data.takes import Takes, posed_once
from facert.data.text import plural
from facert.errors import InputError
from facert.methods.registry import method_class, require_known
from facert.models.optim.monitor import Monitor
from facert.preprocess.label_checks import warn_of_labels
from facert.preprocess.motion.estimate import MotionEstimate
from facert.preprocess.motion.pooled import PooledEstimate
from facert.preprocess.preparation import TrainingData, training_data
from facert.regions.learning import Learned, StartingModel, learn
from facert.retarget.as_predicted import with_predicted
from facert.retarget.retargeter import Retargeter
from facert.settings import Settings

log = logging.getLogger("facert")


def train(
    take: Take | Sequence[Take] | Takes,
    settings: Settings | None = None,
    monitor: Monitor | None = None,
    start: Retargeter | None = None,
    animation: Take | Sequence[Take] = (),
    corrections_only: bool = False,
) -> Retargeter:
    """Learn to retarget from the labels of takes, their other frames, and animation.

    Parameters
    ----------
    take : Take, or sequence of Take
        With poses in some frames; of several takes of one actor, in some of them. Units, names and
        the order of controls are matched to the first. Of a frame that is posed in two takes of one
        recording the pose of the last counts.
    settings : Settings, optional
        By default those of the start, else a blend of experts, see `facert.methods.blend`.
    monitor : Monitor, optional
        Watches the training; see `facert.models.gplvm.fitting`.
    start : Retargeter, optional
        What a shared model begins at, as after a label was added to the take that it was trained
        on: frames and poses that it knows keep their latent coordinates, and a few iterations
        do. One of another form is not used, with a warning; other methods learn in one go anyway.
    animation : Take, or sequence of Take, optional
        Old animation of the character, as poses without a frame: poses of a take, or its weights.
    corrections_only : bool
        Of a corrected result beside other takes, learn from the corrections alone. Else from twice
        as many of its other frames as predicted too, see `facert.retarget.as_predicted`.

    Raises
    ------
    InputError
        When the takes have too few labels, source or poses that never change, or do not fit
        together.
    """
    takes = _learned_from(as_takes(take, animation), corrections_only)
    if settings is None:
        settings = Settings() if start is None else replace(start.settings, labels=None)
    if settings.unlabelled is None:
        settings = replace(settings, unlabelled=method_class(settings.method).most_unlabelled)
    require_known(settings)
    warn_of_labels(takes.joined, takes.frame_name)
    for part, name in takes.named:
        with about(name):
            warn_of_clocks(part)
    data = training_data(takes, settings)
    begin_at = None if start is None else _start(start, data)
    learned = learn(data, settings, monitor or Monitor(), begin_at)
    prepared, chosen = data.prepared, data.chosen
    units = takes.parts[0].units
    return Retargeter(
        method=learned.method,
        layout=data.layout,
        units=units,
        controls=data.controls,
        bounds=data.bounds,
        source_units=prepared.units,
        target_units=data.target_units,
        figures=_noise_figures(prepared.estimate, units)
        | _figures(learned, len(chosen.X_labelled), data.target_units)
        | _of_takes(prepared.takes),
        neutral=data.neutral,
        motion=None if prepared.estimate is None else prepared.estimate.motion,
        labels=len(chosen.X_labelled),
        labelled=chosen.X_labelled,
        poses=data.kept,
    )


def _learned_from(given: Takes, corrections_only: bool) -> Takes:
    """The takes with the poses to learn from: without those that a model predicted, but for a few.

    Refused where no others are there.
    """
    counts = [predicted_poses(part) for part in given.parts]
    if len(given.parts) == 1:
        check_poses(given.parts[0])
    elif sum(counts) and sum(counts) == given.labels:
        raise _all_predicted(sum(counts))
    takes = posed_once(given.with_parts([without_predicted(part) for part in given.parts]))
    if len(given.parts) == 1:
        return takes
    _warn_of_results(given)
    return takes if corrections_only else with_predicted(takes, given)


def _warn_of_results(takes: Takes) -> None:
    """Warn of takes with predicted poses, each by its file."""
    for part, name in takes.named:
        count = predicted_poses(part)
        if count:
            own = plural(len(part.labels) - count, "other pose")
            text = "%s: %s predicted by a model, and not learned from; %s learned from"
            log.warning(text, name, plural(count, "pose"), own)


def _of_takes(takes: Takes) -> dict[str, Any]:
    """The takes that a model learned from and their labels, where there are several."""
    if len(takes.parts) == 1:
        return {}
    each = (f"{name} ({plural(len(part.labels), 'pose')})" for part, name in takes.named)
    return {"takes": ", ".join(each)}


def check_poses(take: Take) -> None:
    """Refuse labels that a model predicted, which their standard deviations show.

    Raises
    ------
    InputError
        When all of them are predicted: a result of retargeting was taken for what it was learned
        from. Where some are, as in a result that was corrected, the log names how many.
    """
    predicted = predicted_poses(take)
    if predicted and predicted == len(take.labels):
        raise _all_predicted(predicted)
    if predicted:
        log.warning(
            "%s predicted by a model, and not learned from, but the other %d are",
            *(plural(predicted, "pose"), len(take.labels) - predicted),
        )


def _all_predicted(count: int) -> InputError:
    return InputError(
        "/target/std",
        "poses that somebody set",
        f"a model predicted all {count} of them",
        "Give the take that was posed; --allow-predicted (in Python "
        "take.with_poses(take.controls, take.params)) learns from these nonetheless.",
    )


def _start(start: Retargeter, data: TrainingData) -> StartingModel:
    """A trained model to begin at, and what makes it unfit for this take, if anything."""
    forms = {
        "kind of source": (data.layout.kind, start.layout.kind),
        "unit of markers": (data.prepared.take.units, start.units),
        "markers or weights": (data.layout.names, start.layout.names),
        "controls": (data.controls.names, start.controls.names),
    }
    difference = next((what for what, (here, there) in forms.items() if here != there), None)
    return StartingModel(start.method, start.source_units, start.target_units, difference)


def _noise_figures(found: MotionEstimate | PooledEstimate | None, unit: str) -> dict[str, Any]:
    """Noise and motion in the take's units."""
    if found is None:
        return {}
    unit = f", {unit}" if unit else ""
    return {f"capture noise{unit}": found.sigma, f"motion a frame{unit}": found.sigma_t}


def _figures(learned: Learned, labels: int, target_units: Normalisation) -> dict[str, Any]:
    """Figures of the training for people, errors in the controls' units."""
    figures: dict[str, Any] = {"labelled frames": labels, "seconds": learned.seconds}
    result = learned.report.result
    if result is not None:
        figures |= {
            "objective": result.value,
            "gradient norm": result.gradient_norm,
            "iterations": result.iterations,
            "status": result.status,
        }
    unit = target_units.scale  # of errors, so that they compare with those of retargeting
    errors = {name: value * unit for name, value in learned.report.pose_figures.items()}
    return figures | dict(learned.report.figures) | errors
