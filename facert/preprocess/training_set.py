"""Which frames and poses of a take a method learns from."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.matching_takes import as_takes
from facert.data.memory import require_square
from facert.data.take import Take
from facert.data.takes import Takes
from facert.data.text import listed
from facert.errors import InputError
from facert.models.gaussian import Gaussian
from facert.models.leading_directions import DENSE, LeadingDirections
from facert.settings import Settings

log = logging.getLogger(__name__)

MIN_LABELS = 3
# A frame is used for training when at least so much of it was observed.
MIN_OBSERVED = 0.5
# Gaps are filled from so many frames: enough for a covariance, few enough to be quick.
FILL_FRAMES = 600


@dataclass(frozen=True)
class TrainingSet:
    """Complete arrays in the data's own units."""

    # (l, d_x) and (l, d_y): Frames with their poses
    X_labelled: FloatArray
    Y_labelled: FloatArray
    X_unlabelled: FloatArray  # (m, d_x): Frames without a pose
    Y_unlabelled: FloatArray  # (n, d_y): Poses without a frame
    frames: IntArray  # (l,): The labelled frames' indices in the take


def choose_training_set(given: Take | Takes, settings: Settings) -> TrainingSet:
    """Draw labelled and unlabelled data as the settings ask, by their seed.

    Labels are the frames whose pose is known, or ``settings.labels`` of them; every other frame
    may serve as unlabelled source; `take.animation` is the unlabelled target. With another label
    the rest of the draw stays as it was, as far as it can: a model that begins at the one before
    then knows its frames. Of several takes each gives frames in proportion to its labels: all of
    the take with most of them, and as many a label of the others (`serving`).

    Raises
    ------
    InputError
        With fewer than three labels, more asked for than there are, or nothing that moves.
    """
    takes = as_takes(given)
    take, rng = takes.joined, np.random.default_rng(settings.seed)
    X = take.source.matrix
    usable = np.mean(~np.isnan(X), axis=1) >= MIN_OBSERVED
    order = rng.permutation(len(X))
    count = 0 if take.animation is None else len(take.animation)
    poses = _draw(rng, np.arange(count), settings.unlabelled)

    labels = _choose_labels(_usable_labels(takes, usable), settings, rng)
    serves = usable & serving(takes, settings.seed)
    others = order[serves[order] & ~np.isin(order, labels)]
    unlabelled = np.sort(others[: settings.unlabelled])
    assert take.params is not None  # there are labels
    require_square(take.params.shape[1], "/target/params", "Train on fewer controls.")
    require_square(len(labels), "/target/params, poses", "Ask for fewer: --labels 100.")
    filled = _filled(X, np.concatenate([labels, unlabelled]), rng)
    animation = take.params if take.animation is None else take.animation
    return TrainingSet(
        X_labelled=filled[: len(labels)],
        Y_labelled=take.params[labels],
        X_unlabelled=filled[len(labels) :],
        Y_unlabelled=animation[poses],
        frames=labels,
    )


def serving(takes: Takes, seed: int) -> BoolArray:
    """The frames that may serve without a pose, (T,), drawn by a seed.

    Frames show how the face moves in the takes that the labels stand for. A take of a few labels
    with all of its frames would outweigh one of many: its errors rose by up to a quarter.
    """
    labels = np.array([len(part.labels) for part in takes.parts])
    if len(labels) == 1 or not labels.any():
        return np.ones(takes.starts[-1], dtype=np.bool_)
    rate = len(takes.parts[int(labels.argmax())]) / labels.max()
    chosen = []
    for part, count in zip(takes.parts, labels, strict=True):
        order = np.random.default_rng(seed).permutation(len(part))
        chosen.append(order < np.ceil(rate * count))
    return np.concatenate(chosen)


def _usable_labels(takes: Takes, usable: BoolArray) -> IntArray:
    labels = takes.joined.labels
    dropped = labels[~usable[labels]].tolist()
    if dropped:
        named = listed([takes.frame_name(frame) for frame in dropped])
        text = "%d posed frames show less than half of the source: left out (%s)"
        log.warning(text, len(dropped), named)
    return labels[usable[labels]]


def _choose_labels(labels: IntArray, settings: Settings, rng: np.random.Generator) -> IntArray:
    count = len(labels) if settings.labels is None else settings.labels
    if count > len(labels):
        expected, found = f"at most {len(labels)}, the posed frames of the take", f"{count}"
        raise InputError("labels", expected, found, "Pose more frames or ask for fewer.")
    if count < MIN_LABELS:
        raise InputError(
            "/target/params" if settings.labels is None else "labels",
            f"at least {MIN_LABELS} posed frames",
            f"{count}",
            "Pose more frames (10 to 40 serve well).",
        )
    return labels if settings.labels is None else _draw(rng, labels, count)


def _draw(rng: np.random.Generator, indices: IntArray, count: int | None) -> IntArray:
    """At most `count` of the indices at random, or all for None; in rising order."""
    chosen = rng.permutation(indices)[:count]
    return np.sort(chosen)


def _filled(X: FloatArray, rows: IntArray, rng: np.random.Generator) -> FloatArray:
    """The rows of X with their gaps filled from the rest of the take."""
    gaps = np.isnan(X[rows]).any(axis=1)
    if not gaps.any():
        return X[rows]
    log.info("filled gaps in %d of %d training frames", int(gaps.sum()), len(rows))
    rest = np.setdiff1d(np.arange(len(X)), rows)
    more = _draw(rng, rest, max(FILL_FRAMES - len(rows), 0))
    support = np.concatenate([_draw(rng, rows, FILL_FRAMES), more])
    # What none of them shows is taken from the first frame that does.
    seen = ~np.isnan(X)
    unseen = ~seen[support].any(axis=0)
    support = np.concatenate([support, np.unique(seen[:, unseen].argmax(axis=0))])
    if X.shape[1] > DENSE:
        return LeadingDirections.learned(X[support]).fill(X[rows])[0]
    return Gaussian.of(X[support]).fill(X[rows])
