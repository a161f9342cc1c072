"""The door from `train` to the methods: regions found, open noise estimated, a method fitted."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.data.regions import Regions
from facert.methods.base import Labelled, Method, TrainingReport, Unlabelled, WarmStart
from facert.methods.noise import enough, with_noise
from facert.methods.registry import method_class
from facert.models.leading_directions import DENSE
from facert.models.optim.monitor import Monitor
from facert.preprocess.preparation import TrainingData
from facert.regions.automatic import find_regions
from facert.regions.layout import lay_out
from facert.regions.regional import untrained_method
from facert.settings import Settings

log = logging.getLogger("facert")

CONSTANT = 0.05
"""A model is all but constant whose poses vary by less than this share of what the labels do.

On real recordings models that had learned something from 5 to 40 labels lay above it, regressions
that had collapsed to their mean far below.
"""
MOST_FRAMES = 100
"""Frames that this is judged by, at most."""


@dataclass(frozen=True)
class StartingModel:
    """A trained model for a method to begin at."""

    method: Method
    # Units that it was trained in
    source_units: Normalisation
    target_units: Normalisation
    # What in its source or target differs from the take to train on; it is then not used
    difference: str | None


@dataclass(frozen=True)
class Learned:
    """A trained method, what it reports, and how many seconds its fit took."""

    method: Method
    report: TrainingReport
    seconds: float


def learn(
    data: TrainingData, settings: Settings, monitor: Monitor, start: StartingModel | None = None
) -> Learned:
    """Fit the method of the settings to a take; with regions, once for each of them.

    Parameters
    ----------
    data : TrainingData
    settings : Settings
        Regions that are to be found, and noise that is open, are taken from the data.
    monitor : Monitor
        Watches the optimiser.
    start : StartingModel, optional
        What the method begins at; one that learns in one go does without.

    Raises
    ------
    InputError
        When there is no method of that name, the regions do not fit the take, or nothing moves in
        one of them.
    """
    regions = _resolved(settings.regions, data)
    step = data.step if settings.sigma_t is None else settings.sigma_t
    given = replace(settings, regions=regions, sigma_t=step)
    source, target, chosen = data.prepared.units, data.target_units, data.chosen
    layout = None if regions is None else lay_out(regions, data, given)
    dense = len(source.mean) > DENSE
    open_noise = source.apply(enough(data.complete))
    method = untrained_method(with_noise(given, open_noise), dense, layout)
    if start is not None and method_class(given.method).stepwise:
        _begin(method, start, source, target)
    labelled = Labelled(source.apply(chosen.X_labelled), target.apply(chosen.Y_labelled))
    unlimited = np.outer([-np.inf, np.inf], np.ones(len(target.mean)))
    unlabelled = Unlabelled(
        source.apply(chosen.X_unlabelled),
        target.apply(chosen.Y_unlabelled),
        target.apply(unlimited if data.bounds is None else data.bounds.T),
    )
    began = time.perf_counter()
    report = method.fit(labelled, unlabelled, monitor)
    seconds = time.perf_counter() - began
    some = unlabelled.X[:: max(len(unlabelled.X) // MOST_FRAMES, 1)]
    warn_if_constant(method, np.vstack([labelled.X, some]), labelled.Y)
    return Learned(method, report, seconds)


def _resolved(wanted: Regions | str | None, data: TrainingData) -> Regions | None:
    """Regions by the names of a take, found in it where they are not given."""
    if wanted is None:
        return None
    if isinstance(wanted, str):
        return find_regions(data.prepared.take)
    return wanted.matched(data.names, data.controls.names).seen_by(data.prepared.take.source.names)


def _begin(
    method: Method, start: StartingModel, source_units: Normalisation, target_units: Normalisation
) -> None:
    """Let a method begin at a trained one, unless something keeps it from that."""
    new, old = method.settings, start.method.settings
    forms = ("method", "latent_dim", "regions")
    other = next((name for name in forms if getattr(new, name) != getattr(old, name)), None)
    other = other or start.difference
    if other is None and type(method) is not type(start.method):
        other = "form"  # of an earlier release, which took a dense source as it is
    if other is not None:
        log.warning("training begins anew: the start has another %s", other)
        return
    assert isinstance(method, WarmStart)
    method.begin_at(
        start.method,
        source_units.seen_from(start.source_units),
        target_units.seen_from(start.target_units),
    )


def warn_if_constant(method: Method, frames: FloatArray, labels: FloatArray) -> None:
    """Warn of a model that predicts nearly the same pose for every frame.

    Parameters
    ----------
    method : Method
        After `fit`.
    frames : array, shape (n, d_x)
        Normalised frames; `MOST_FRAMES` of them, evenly spread, are mapped.
    labels : array, shape (l, d_y)
        The normalised poses that it learned from.
    """
    some = frames[:: -(-len(frames) // MOST_FRAMES)]
    share = _spread(method.predict(some).Y) / _spread(labels)
    if share < CONSTANT:
        log.warning(
            "the model predicts nearly the same pose for every frame: these vary %.1f %% as much"
            " as the posed ones. %s may help",
            100 * share,
            _remedy(method.settings),
        )


def _remedy(settings: Settings) -> str:
    """What may help a method that learned next to nothing."""
    if settings.method == Settings().method:
        return "More poses, or others (facert suggest names frames to pose),"
    return f"Another method ({Settings().method}), or more poses,"


def _spread(poses: FloatArray) -> float:
    """Distance of poses (n, P) to their mean, root mean square; above 0."""
    return float(np.sqrt(poses.var(axis=0).sum())) + np.finfo(np.float64).tiny
