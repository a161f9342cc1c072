"""Mistakes that nothing fails of: labels that nobody posed, a model that says always the same."""

from __future__ import annotations

import logging

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.labelling import predicted_poses
from facert.data.take import Take
from facert.data.text import plural
from facert.errors import InputError
from facert.methods.base import Method

log = logging.getLogger("facert")

CONSTANT = 0.05
"""Poses said of the frames vary so much, as a share of the labels, or a model is all but constant.

On real recordings models that had learned something from 5 to 40 labels lay above it, regressions
that had collapsed to their mean far below.
"""

MOST_FRAMES = 100


def check_poses(take: Take) -> None:
    """Tell poses that a model predicted, and so have a standard deviation, from labels.

    Raises
    ------
    InputError
        When all of them are predicted: a result of retargeting was taken for what it was learned
        from. Of some the log warns.
    """
    predicted = predicted_poses(take)
    if predicted and predicted == len(take.labels):
        raise InputError(
            "/target/std",
            "poses that somebody set",
            f"a standard deviation for all {predicted}: a model predicted them",
            "Give the take that was posed; --allow-predicted (in Python a take with std=None) "
            "learns from these nonetheless.",
        )
    if predicted:
        poses = plural(predicted, "pose")
        log.warning("%s with a standard deviation: predicted, and learned from as labels", poses)


def warn_if_constant(method: Method, frames: FloatArray, labels: FloatArray) -> None:
    """Warn of a model that says nearly the same pose of every frame.

    Parameters
    ----------
    method : Method
        After `fit`.
    frames : array, shape (n, d_x)
        Normalised frames; `MOST_FRAMES` of them, evenly spread, are looked at.
    labels : array, shape (l, d_y)
        The normalised poses that it learned from.
    """
    some = frames[:: -(-len(frames) // MOST_FRAMES)]
    share = _spread(method.predict(some).Y) / _spread(labels)
    if share < CONSTANT:
        log.warning(
            "the model says nearly the same pose of every frame: these vary %.1f %% as much as the"
            " posed ones. Another method (auto), or more poses, may help",
            100 * share,
        )


def _spread(poses: FloatArray) -> float:
    """Distance of poses (n, P) to their mean, root mean square; above 0."""
    return float(np.sqrt(poses.var(axis=0).sum())) + np.finfo(np.float64).tiny
