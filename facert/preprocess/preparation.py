"""Preparation of recorded takes for training: all that `train` learns from.

Each take is cleaned on its own, by its own noise, gaps and clock; noise and motion are then learned
from all of them. Methods are given the frames of the takes in which some have a pose: those of
another shot, in which none has, make them worse (`experiments/second_take.py`).
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.matching_takes import as_takes
from facert.data.normalisation import Normalisation
from facert.data.subject import about
from facert.data.take import Controls, Source, Take
from facert.data.takes import Takes, separated
from facert.data.text import plural
from facert.errors import InputError
from facert.preprocess.clean_source import other_unit
from facert.preprocess.faults import without_faults
from facert.preprocess.known_poses import keep, pose_bounds
from facert.preprocess.motion.estimate import LEAST_NOISE, MotionEstimate, estimate_if_it_moves
from facert.preprocess.motion.pooled import PooledEstimate, pooled
from facert.preprocess.motion.series import capture_noise, largest_step
from facert.preprocess.neutral import Calibration, at_rest, most_neutral, rest_frames
from facert.preprocess.source_layout import SourceLayout
from facert.preprocess.training_set import MIN_OBSERVED, TrainingSet, choose_training_set
from facert.settings import Settings

log = logging.getLogger(__name__)

APART = 1.0
"""Takes are far apart when most numbers are so many standard deviations of the largest motion
within a take."""
LEFT = 0.3
"""This share of the noise is left in the frames that are learned from. It holds a method back from
reading much into motion as small as the noise, which would not hold for expressions that no label
shows: with none left, errors were 8 % less within a take and up to 20 % more in another part of
it; with this share, 5 % less and 1 % more."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """Takes to learn from."""

    # Without what no frame shows, bad markers, noise and gaps, as far as the settings ask. Frames
    # that show too little to be learned from are as they were.
    takes: Takes
    take: Take  # Frames of those with a pose, one take after the other
    measured: Source  # The same with noise and gaps
    step: float  # From one frame to the next, normalised units: σ_t, Eq. (14)
    units: Normalisation  # Of the measured source
    # Estimate of noise and motion; None where frames do not follow each other
    estimate: MotionEstimate | PooledEstimate | None


@dataclass(frozen=True, eq=False)
class TrainingData:
    """Training data of takes, in their units, and the units to normalise it by."""

    prepared: Prepared
    # Names of the markers or weights that the takes were recorded with, seen or not
    names: tuple[str, ...]
    layout: SourceLayout  # Of the prepared takes
    controls: Controls
    chosen: TrainingSet  # Frames and poses that a method is given
    poses: FloatArray  # (l + n, P): All these poses, those of the labelled frames first
    step: float  # How far frames move on from one to the next, normalised units: σ_t, Eq. (14).
    complete: FloatArray  # (n, d_x): Frames that show everything, to estimate the noise from
    neutral: FloatArray  # (d_x,): The source with the actor at rest; see `Settings.neutral`
    bounds: FloatArray | None  # What poses are clipped to
    target_units: Normalisation  # Of the chosen poses
    kept: FloatArray  # (k, P): Known poses that a model keeps


def training_data(given: Take | Takes, settings: Settings) -> TrainingData:
    """Clean takes, and draw from them what a method is to learn.

    Raises
    ------
    InputError
        When the takes have too few labels, or source or poses that never change.
    """
    takes = as_takes(given)
    controls = takes.parts[0].controls
    if controls is None:
        fix = (
            "Pose 10 to 40 frames: facert suggest names frames to pose, and "
            "facert convert ... --poses poses.csv brings the poses in."
        )
        raise InputError("/target", "poses in some frames", "none", fix)
    prepared = prepare(takes, settings)
    clean = prepared.take
    chosen = choose_training_set(prepared.takes.posed, settings)
    poses = np.vstack([chosen.Y_labelled, chosen.Y_unlabelled])
    return TrainingData(
        prepared=prepared,
        names=takes.parts[0].source.names,
        layout=SourceLayout(clean.source.kind, clean.source.names),
        controls=controls,
        chosen=chosen,
        poses=poses,
        step=prepared.step,
        complete=_complete_frames(clean.source, chosen),
        neutral=_neutral(prepared.takes, chosen, settings),
        bounds=pose_bounds(clean, chosen.Y_labelled, settings.limits),
        target_units=Normalisation.of(poses, "/target/params"),
        kept=keep(chosen.Y_labelled, clean.animation, settings.seed),
    )


def prepare(given: Take | Takes, settings: Settings) -> Prepared:
    """Take bad markers, noise and gaps out of takes, and what no frame shows.

    Raises
    ------
    InputError
        When nothing moves.
    """
    takes = as_takes(given)
    observed = _calibrated(_each(takes, partial(_without_faults, settings=settings)), settings)
    observed = _observed_part(observed)
    posed = observed.posed
    measured = posed.joined.source
    units = Normalisation.of(measured.matrix, f"/source/{measured.kind}")
    _warn_of_distance(observed)
    cleaned = [_cleaned(part, name, settings) for part, name in observed.named]
    estimate = _of_all(observed, [found for _, found in cleaned], units)
    clean = observed.with_parts([part for part, _ in cleaned])
    step = _step(posed) if estimate is None else estimate.sigma_t
    step = max(step / units.scale, LEAST_NOISE)
    return Prepared(clean, clean.posed.joined, measured, step, units, estimate)


def _of_all(
    takes: Takes, found: Sequence[MotionEstimate | None], units: Normalisation
) -> MotionEstimate | PooledEstimate | None:
    """Noise and motion of all takes whose frames follow each other."""
    moving = [(part, one) for part, one in zip(takes.parts, found, strict=True) if one is not None]
    if len(found) == 1 or not moving:
        return found[0]
    matrices = [part.source.matrix for part, _ in moving]
    return pooled([one for _, one in moving], matrices, [part.time for part, _ in moving], units)


def _each(takes: Takes, work: Callable[[Take], Take]) -> Takes:
    """Work done with each take, named in the log and in errors where there are several."""
    parts = []
    for part, name in takes.named:
        with about(name):
            parts.append(work(part))
    return takes.with_parts(parts)


def _without_faults(take: Take, settings: Settings) -> Take:
    if settings.detect:
        return without_faults(take)
    _warn_of_zeros(take.source)
    return take


def _cleaned(take: Take, name: str, settings: Settings) -> tuple[Take, MotionEstimate | None]:
    """A take without noise and gaps, as far as the settings ask, and its estimate."""
    source = take.source
    with about(name):
        found = estimate_if_it_moves(source.matrix, take.time) if settings.smooth else None
        if found is None:
            return take, None
        log.info("%s", found.summary(take.units))
    measured, clean = source.matrix, found.frames
    left = np.where(np.isnan(measured), clean, clean + LEFT * (measured - clean))
    shown = source.valid.mean(axis=1) >= MIN_OBSERVED
    frames = np.where(shown[:, None], left, measured)
    return replace(take, source=source.with_matrix(frames)), found


def _calibrated(takes: Takes, settings: Settings) -> Takes:
    """Takes moved to the first by the actor at rest, where both name it."""
    rests = rest_frames(settings.neutral, takes)
    if len(takes.parts) == 1 or rests[0] is None:
        return takes
    first, *_ = takes.parts
    learned = at_rest(first.source.matrix, rests[0])
    parts = [first]
    for (part, name), frames in zip(takes.named[1:], rests[1:], strict=True):
        if frames is None:
            text = "%s: taken to be recorded as %s was, as no --neutral is given for it"
            log.info(text, name, takes.names[0])
            parts.append(part)
            continue
        with about(name):
            own = at_rest(part.source.matrix, frames)
        moved = Calibration.of(own, learned, part.source.kind).apply(part.source.matrix)
        parts.append(replace(part, source=part.source.with_matrix(moved)))
    return takes.with_parts(parts)


def _observed_part(takes: Takes) -> Takes:
    """Takes without markers or weights that no frame shows: nothing can be learned of them."""
    first = takes.parts[0].source
    seen = np.any([part.source.valid.any(axis=0) for part in takes.posed.parts], axis=0)
    if seen.all():
        return takes
    silent = [name for name, there in zip(first.names, seen, strict=True) if not there]
    log.warning("never observed in the take, left out: %s", ", ".join(silent))
    names = tuple(name for name, there in zip(first.names, seen, strict=True) if there)
    return takes.with_parts(
        [replace(one, source=Source(one.source.values[:, seen], names)) for one in takes.parts]
    )


def _warn_of_distance(takes: Takes) -> None:
    """Warn of takes that lie far from the first: by their unit, or as the head stands elsewhere."""
    if len(takes.parts) == 1:
        return
    matrices = [part.source.matrix for part in takes.parts]
    first, *others = ((_centre(X), _largest_motion(X)) for X in matrices)
    kind = takes.parts[0].source.kind
    for name, X, (centre, motion) in zip(takes.names[1:], matrices[1:], others, strict=True):
        away = float(np.nanmedian(np.abs(centre - first[0]))) / max(first[1], motion)
        if away > APART:
            cause = "another unit, or head motion that facert stabilise takes out?"
            if kind == "weights":
                other = "another tracker? --neutral names frames at rest"
                cause = other_unit(X, first[0]) or other
            text = "%s lies far from %s, most of it %.2g times as far as the face moves: %s"
            log.warning(text, name, takes.names[0], away, cause)


def _centre(X: FloatArray) -> FloatArray:
    """Mean of each column of X (T, d), (d,); NaN for one that shows nothing."""
    seen = ~np.isnan(X)
    total = np.where(seen, X, 0.0).sum(axis=0)
    return np.where(seen.any(axis=0), total / np.maximum(seen.sum(axis=0), 1), np.nan)


def _largest_motion(X: FloatArray) -> float:
    """The largest standard deviation of a column of X (T, d)."""
    shown = X[:, ~np.isnan(X).all(axis=0)]
    tiny = float(np.finfo(np.float64).tiny)
    return max(float(np.nanstd(shown, axis=0).max(initial=0.0)), tiny)


def _warn_of_zeros(source: Source) -> None:
    """Warn of markers at (0, 0, 0), which some systems write for a lost one."""
    if source.kind != "markers":
        return
    zeros = int(np.sum(~source.values.any(axis=2)))
    if zeros:
        positions = plural(zeros, "marker position")
        log.warning("%s exactly at (0, 0, 0): lost ones should be NaN", positions)


def _step(takes: Takes) -> float:
    """The distance from one frame to the next in takes whose frames hardly follow each other."""
    X = separated([part.source.matrix for part in takes.parts])
    return largest_step(X, capture_noise(X))


def _complete_frames(source: Source, chosen: TrainingSet) -> FloatArray:
    """Frames that show everything, (n, d); where they are few, the filled ones of the training."""
    shown = ~np.isnan(source.matrix).any(axis=1)
    if np.count_nonzero(shown) > len(chosen.X_labelled) + len(chosen.X_unlabelled):
        return source.matrix[shown]
    return np.vstack([chosen.X_labelled, chosen.X_unlabelled])


def _neutral(takes: Takes, chosen: TrainingSet, settings: Settings) -> FloatArray:
    """The source with the actor at rest, (d_x,): in frames that are named, or the smallest pose."""
    frames = rest_frames(settings.neutral, takes)[0]
    if frames is None:
        return np.asarray(chosen.X_labelled[most_neutral(chosen.Y_labelled)])
    rest = at_rest(takes.parts[0].source.matrix, frames)
    if np.isnan(rest).any():
        raise InputError("neutral", "frames that show the face", "hidden markers", "Name others.")
    return rest
