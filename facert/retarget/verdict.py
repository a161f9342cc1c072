"""The verdict on a retargeted take: good, look at it, or bad, why, where, and what helps.

The error of a take is not known where its true poses are not. What makes poses err is: frames that
are like no posed one, whatever the cause (`facert.retarget.source_reasons`), and what shows in the
poses themselves (`facert.retarget.pose_reasons`). The worst reason is the level of the take.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.take import Take
from facert.data.text import plural
from facert.data.verdict import LEVELS, Reason, Verdict
from facert.errors import InputError
from facert.preprocess.motion.estimate import FEWEST
from facert.retarget.model import TrainedModel
from facert.retarget.options import RetargetOptions
from facert.retarget.pose_reasons import pose_reasons
from facert.retarget.source_reasons import UNLIKE, source_reasons


def judge(
    take: Take | None,
    result: Take,
    model: TrainedModel,
    options: RetargetOptions | None = None,
) -> Verdict:
    """The verdict on a take that was retargeted by a model.

    Parameters
    ----------
    take : Take or None
        As it was recorded, with its gaps; without it, gaps are not judged.
    result : Take
        With the cleaned source and the poses.
    model : TrainedModel
    options : RetargetOptions, optional
        With which it was retargeted.

    Raises
    ------
    InputError
        When the result has no poses, or those of other controls.
    """
    if result.params is None or result.controls is None or not len(result.labels):
        raise InputError("/target/params", "poses", "none", "Give a take that was retargeted.")
    if result.controls.names != model.controls.names:
        expected, found = "the controls of the model", "others"
        raise InputError("/target/names", expected, found, "Give the model that made the result.")
    if len(result) < FEWEST:  # shares of single frames mean nothing
        return _of_few(result)
    detect = options is None or options.detect
    of_source, unlike = source_reasons(take, result, model, detect)
    off = np.zeros(len(result), dtype=np.bool_)
    for reason in of_source:
        off[reason.frames] |= reason.kind in UNLIKE
    of_poses, unsure = pose_reasons(result, model, off)
    reasons = sorted([*of_source, *of_poses], key=lambda reason: -LEVELS.index(reason.level))
    return Verdict(tuple(reasons), _anomaly(reasons, unlike, unsure), result.time)


def _of_few(result: Take) -> Verdict:
    """The verdict on a take that is too short for one: nobody said that it is good."""
    text = f"{plural(len(result), 'frame')}, and {FEWEST} are needed to judge poses"
    cure = "look at each of them, as facert view shows it"
    return Verdict(
        (Reason("short", "look at it", text, cure, np.arange(len(result))),),
        np.ones(len(result)),
        result.time,
    )


def _anomaly(
    reasons: Sequence[Reason], unlike: FloatArray | None, unsure: FloatArray
) -> FloatArray:
    """How anomalous each frame is, (T,)."""
    anomaly = unsure.copy() if unlike is None else unsure + np.log1p(unlike)
    for reason in reasons:
        anomaly[reason.frames] += LEVELS.index(reason.level)
    return anomaly
