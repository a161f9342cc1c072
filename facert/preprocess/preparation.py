"""Preparation of a recorded take for training: all that `train` learns from."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.normalisation import Normalisation
from facert.data.ranges import parse_frames
from facert.data.take import Controls, Source, Take
from facert.data.text import plural
from facert.errors import InputError
from facert.preprocess.faults import without_faults
from facert.preprocess.known_poses import keep, pose_bounds
from facert.preprocess.motion.estimate import LEAST_NOISE, MotionEstimate, estimate_if_it_moves
from facert.preprocess.motion.series import capture_noise, largest_step
from facert.preprocess.neutral import at_rest, most_neutral
from facert.preprocess.source_layout import SourceLayout
from facert.preprocess.training_set import MIN_OBSERVED, TrainingSet, choose_training_set
from facert.settings import Settings

log = logging.getLogger(__name__)

LEFT = 0.3
"""This share of the noise is left in the frames that are learned from. It holds a method back from
reading much into motion as small as the noise, which would not hold for expressions that no label
shows: with none left, errors were 8 % less within a take and up to 20 % more in another part of
it; with this share, 5 % less and 1 % more."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """A take to learn from."""

    # Without what no frame shows, bad markers, noise and gaps, as far as the settings ask. Frames
    # that show too little to be learned from are as they were.
    take: Take
    measured: Source  # The same with noise and gaps
    units: Normalisation  # Of the measured source
    # Estimate of noise and motion; None where frames do not follow each other
    estimate: MotionEstimate | None


@dataclass(frozen=True, eq=False)
class TrainingData:
    """Training data of a take, in the take's units, and the units to normalise it by."""

    prepared: Prepared
    # Names of the markers or weights that the take was recorded with, seen or not
    names: tuple[str, ...]
    layout: SourceLayout  # Of the prepared take
    controls: Controls
    chosen: TrainingSet  # Frames and poses that a method is given
    poses: FloatArray  # (l + n, P): All these poses, those of the labelled frames first
    step: float  # How far frames move on from one to the next, normalised units: σ_t, Eq. (14).
    complete: FloatArray  # (n, d_x): Frames that show everything, to estimate the noise from
    neutral: FloatArray  # (d_x,): The source with the actor at rest; see `Settings.neutral`
    bounds: FloatArray | None  # What poses are clipped to
    target_units: Normalisation  # Of the chosen poses
    kept: FloatArray  # (k, P): Known poses that a model keeps


def training_data(take: Take, settings: Settings) -> TrainingData:
    """Clean a take, and draw from it what a method is to learn.

    Raises
    ------
    InputError
        When the take has too few labels, or source or poses that never change.
    """
    if take.controls is None:
        fix = (
            "Pose 10 to 40 frames: facert suggest names frames to pose, and "
            "facert convert ... --poses poses.csv brings the poses in."
        )
        raise InputError("/target", "poses in some frames", "none", fix)
    prepared = prepare(take, settings)
    clean = prepared.take
    chosen = choose_training_set(clean, settings)
    poses = np.vstack([chosen.Y_labelled, chosen.Y_unlabelled])
    return TrainingData(
        prepared=prepared,
        names=take.source.names,
        layout=SourceLayout(clean.source.kind, clean.source.names),
        controls=take.controls,
        chosen=chosen,
        poses=poses,
        step=_step(prepared),
        complete=_complete_frames(clean.source, chosen),
        neutral=_neutral(clean, chosen, settings),
        bounds=pose_bounds(clean, chosen.Y_labelled, settings.limits),
        target_units=Normalisation.of(poses, "/target/params"),
        kept=keep(chosen.Y_labelled, clean.animation, settings.seed),
    )


def prepare(take: Take, settings: Settings) -> Prepared:
    """Take bad markers, noise and gaps out of a take, and what no frame shows.

    Raises
    ------
    InputError
        When nothing moves.
    """
    if settings.detect:
        take = without_faults(take)
    else:
        _warn_of_zeros(take.source)
    source = _observed_part(take.source)
    units = Normalisation.of(source.matrix, f"/source/{source.kind}")
    found = estimate_if_it_moves(source.matrix, take.time) if settings.smooth else None
    if found is None:
        return Prepared(replace(take, source=source), source, units, None)
    log.info("%s", found.summary(take.units))
    measured, clean = source.matrix, found.frames
    left = np.where(np.isnan(measured), clean, clean + LEFT * (measured - clean))
    shown = source.valid.mean(axis=1) >= MIN_OBSERVED
    frames = np.where(shown[:, None], left, measured)
    return Prepared(replace(take, source=source.with_matrix(frames)), source, units, found)


def _observed_part(source: Source) -> Source:
    """The source without markers or weights that no frame shows: nothing can be learned of them."""
    seen = np.asarray(source.valid.any(axis=0))
    if seen.all():
        return source
    silent = [name for name, there in zip(source.names, seen, strict=True) if not there]
    log.warning("never observed in the take, left out: %s", ", ".join(silent))
    names = tuple(name for name, there in zip(source.names, seen, strict=True) if there)
    return Source(source.values[:, seen], names)


def _warn_of_zeros(source: Source) -> None:
    """Warn of markers at (0, 0, 0), which some systems write for a lost one."""
    if source.kind != "markers":
        return
    zeros = int(np.sum(~source.values.any(axis=2)))
    if zeros:
        positions = plural(zeros, "marker position")
        log.warning("%s exactly at (0, 0, 0): lost ones should be NaN", positions)


def _step(prepared: Prepared) -> float:
    """The distance from one frame to the next, normalised units."""
    if prepared.estimate is None:
        X = prepared.measured.matrix
        step = largest_step(X, capture_noise(X))
    else:
        step = prepared.estimate.sigma_t
    return max(step / prepared.units.scale, LEAST_NOISE)


def _complete_frames(source: Source, chosen: TrainingSet) -> FloatArray:
    """Frames that show everything, (n, d); where they are few, the filled ones of the training."""
    complete = source.matrix[~np.isnan(source.matrix).any(axis=1)]
    filled = np.vstack([chosen.X_labelled, chosen.X_unlabelled])
    return complete if len(complete) > len(filled) else filled


def _neutral(take: Take, chosen: TrainingSet, settings: Settings) -> FloatArray:
    """The source with the actor at rest, (d_x,): in frames that are named, or the smallest pose."""
    if settings.neutral is None:
        return np.asarray(chosen.X_labelled[most_neutral(chosen.Y_labelled)])
    frames = np.array(parse_frames(settings.neutral, "neutral"), dtype=np.int64)
    rest = at_rest(take.source.matrix, frames)
    if np.isnan(rest).any():
        raise InputError("neutral", "frames that show the face", "hidden markers", "Name others.")
    return rest
