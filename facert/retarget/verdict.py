"""The verdict on a retargeted take: good, look at it, or bad, why, where, and what helps.

The error of a take is not known where its true poses are not. What makes poses err is: frames that
are like no posed one, whatever the cause (`facert.retarget.source_reasons`), and what shows in the
poses themselves (`facert.retarget.pose_reasons`). The worst reason is the level of the take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facert.data.arrays import FloatArray, IntArray, frozen
from facert.data.take import Take
from facert.errors import InputError
from facert.preprocess.motion.estimate import FEWEST
from facert.retarget.model import TrainedModel
from facert.retarget.options import RetargetOptions
from facert.retarget.pose_reasons import pose_reasons
from facert.retarget.reasons import LEVELS, Level, Reason
from facert.retarget.source_reasons import source_reasons

APART = 1.0
"""Seconds between two of the worst frames."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What to think of a retargeted take.

    Parameters
    ----------
    reasons : tuple of Reason
        The worst first.
    doubt : array, shape (T,)
        How much each frame is to be doubted, to find the worst ones: beside other frames only.
    time : array, shape (T,)
        Seconds of the frames.
    """

    reasons: tuple[Reason, ...]
    doubt: FloatArray
    time: FloatArray

    def __post_init__(self) -> None:
        frozen(self.doubt)

    @property
    def level(self) -> Level:
        """The worst level of the reasons; "good" without any."""
        return max((reason.level for reason in self.reasons), key=LEVELS.index, default="good")

    def worst(self, count: int) -> IntArray:
        """The frames to look at first, at most so many, apart in time; in order of time."""
        chosen: list[int] = []
        for frame in np.argsort(-self.doubt, kind="stable"):
            if len(chosen) == count or self.doubt[frame] <= 0.0:
                break
            if all(abs(self.time[frame] - self.time[other]) >= APART for other in chosen):
                chosen.append(int(frame))
        return np.array(sorted(chosen), dtype=np.int64)


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
        As it was recorded, with its gaps; without it, nothing is said of these.
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
        return Verdict((), np.zeros(len(result)), result.time)
    detect = options is None or options.detect
    of_source, unlike = source_reasons(take, result, model, detect)
    of_poses, unsure = pose_reasons(result, model)
    reasons = sorted([*of_source, *of_poses], key=lambda reason: -LEVELS.index(reason.level))
    return Verdict(tuple(reasons), _doubt(reasons, unlike, unsure), result.time)


def _doubt(reasons: Sequence[Reason], unlike: FloatArray | None, unsure: FloatArray) -> FloatArray:
    """How much each frame is to be doubted, (T,)."""
    doubt = unsure.copy() if unlike is None else unsure + unlike
    for reason in reasons:
        doubt[reason.frames] += LEVELS.index(reason.level)
    return doubt
