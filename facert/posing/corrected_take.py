"""A result of retargeting with some of its poses corrected: `correct_take`."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from facert.data.arrays import FloatArray, IntArray
from facert.data.corrections import WIDTH, merged, put_in, taken_out
from facert.data.names import match
from facert.data.take import Controls, Corrections, Take
from facert.errors import InputError
from facert.posing.completed_pose import complete_pose, given_controls
from facert.retarget.retargeter import Retargeter

log = logging.getLogger("facert")

FEWEST = 0.5  # of the frames of a result that have a pose


def correct_take(
    result: Take,
    poses: Mapping[int, Mapping[str, float] | ArrayLike],
    character: Retargeter | Take | None = None,
    *,
    width: float = WIDTH,
    hold: Sequence[str] = (),
    only: bool = False,
    follow: bool = False,
) -> Take:
    """A result of retargeting with the poses of some frames corrected.

    Each corrected frame has exactly what was set; around it the correction fades over time. A
    corrected pose is somebody's: it has no standard deviation, and `train` learns from it. See
    `facert.data.corrections`.

    Parameters
    ----------
    result : Take
        Retargeted. Earlier corrections stay, but for those of the same frames.
    poses : mapping
        For each frame, by its number from 0, the controls that are set, by name in any spelling;
        or a whole pose, (P,).
    character : Retargeter or Take, optional
        Where the poses are from that the character is known to make: from them follows what the
        controls that are not set then do, see `facert.posing.correction`. Needed where some are
        not set.
    width : float
        Seconds of the window over which each correction is blended, half of it before the frame.
        At 0 only the frame itself changes.
    hold : sequence of str
        Controls, or patterns such as ``"mouth*"``, that keep their value unless they are set.
    only : bool
        Change no controls but those that are set.
    follow : bool
        Let the others follow even where no known pose comes near what is set, which is a guess.
        Else they stay there as predicted, which is nearer to the truth on average.

    Returns
    -------
    Take
        `facert.data.corrections.taken_out` gives it back as it was predicted.

    Raises
    ------
    InputError
        For a take that is no result, frames and controls that it has not, values outside of
        limits, or no character where one is needed.
    """
    require_result(result)
    if result.std is None and not result.model and result.corrections is None:
        log.warning("whose its poses are is not known: all but corrected ones count as predicted")
    if not poses:
        raise InputError("frames", "one to correct", "none", "Name a frame and its controls.")
    frames = _frame_numbers(poses)
    outside = frames[(frames < 0) | (frames >= len(result))]
    if len(outside):
        expected = f"0 to {len(result) - 1}"
        raise InputError("frame", expected, f"{outside[0]}", "Count frames from 0.")
    wanted = [
        _pose(result, int(frame), poses[frame], character, hold, only, follow) for frame in frames
    ]
    made = Corrections(frames, np.array(wanted), np.full(len(frames), width))
    return put_in(result, merged(result.corrections, made))


def _frame_numbers(poses: Mapping[int, Mapping[str, float] | ArrayLike]) -> IntArray:
    """The numbers of the frames, (c,), rising."""
    numbers = np.array(sorted(poses))
    if numbers.dtype.kind not in "iu":
        expected, found = "whole numbers of frames", f"{numbers[0]}"
        raise InputError("frame", expected, found, "Count frames from 0.")
    return numbers.astype(np.int64)


def require_result(take: Take) -> None:
    """Refuse what was not retargeted, such as a recording with a few labels.

    Raises
    ------
    InputError
        When most frames have no pose, and those that there are have no deviation.
    """
    bare = take.controls is None or take.params is None
    if bare or (take.std is None and len(take.labels) < FEWEST * len(take)):
        expected, found = "a result: a pose in every frame", f"{len(take.labels)} of {len(take)}"
        fix = "Retarget it first; poses of a recording are added by facert convert --poses."
        raise InputError("/target/params", expected, found, fix)


def _pose(
    result: Take,
    frame: int,
    wanted: Mapping[str, float] | ArrayLike,
    character: Retargeter | Take | None,
    hold: Sequence[str],
    only: bool,
    follow: bool,
) -> FloatArray:
    """The corrected pose of a frame, (P,), in the order of the result's controls."""
    assert result.controls is not None  # it was checked
    assert result.params is not None
    if not isinstance(wanted, Mapping):
        return _whole(result.controls, frame, np.asarray(wanted))
    pose: FloatArray = result.params[frame]
    if np.isnan(pose).any():
        found, fix = f"none in frame {frame}", "Give the whole pose of this frame."
        raise InputError("/target/params", "a predicted pose to correct", found, fix)
    if not only:
        if character is None:
            fix = "Give a model, or leave the others as they are: only."
            expected = "the character's known poses, for the other controls"
            raise InputError("character", expected, "none", fix)
        start = _start(result, frame)
        done = complete_pose(character, wanted, start=start, hold=hold)
        columns = match(result.controls.names, done.controls.names, "controls of the character")
        if follow or not done.far:
            return np.asarray(done.pose[columns], dtype=np.float64)
        log.info("frame %d: the others stay as predicted; --follow lets them follow", frame)
    given = given_controls(result.controls, wanted)
    pose = pose.copy()
    pose[given.controls] = given.values
    return pose


def _whole(controls: Controls, frame: int, pose: FloatArray) -> FloatArray:
    """A whole pose (P,), checked."""
    if pose.shape != (len(controls.names),):
        expected, fix = f"{len(controls.names)} values", "Give one a control."
        raise InputError(f"pose of frame {frame}", expected, f"shape {pose.shape}", fix)
    try:
        given = given_controls(controls, dict(zip(controls.names, pose.tolist(), strict=True)))
    except InputError as error:
        error.field = f"pose of frame {frame}: {error.field}"
        raise
    return given.values


def _start(result: Take, frame: int) -> Take:
    """One frame of a result, with the deviations of its prediction."""
    assert result.params is not None
    std = taken_out(result).std
    seen = np.nan_to_num(result.source.values[[frame]])
    return replace(
        result,
        time=result.time[[frame]],
        source=replace(result.source, values=seen, std=None),
        params=result.params[[frame]],
        std=None if std is None else std[[frame]],
        animation=None,
        corrections=None,
    )
