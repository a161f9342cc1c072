"""Poses from elsewhere, given to the frames of a take."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from facert.data.arrays import FloatArray, IntArray, checked_names
from facert.data.names import NameIndex, instead_of, match
from facert.data.resampling import nearest_frames
from facert.data.rig import Shaped
from facert.data.take import Controls, Take, named_curves
from facert.data.text import listed, plural
from facert.errors import InputError, reading

log = logging.getLogger("facert")


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of a character, each for a frame of a take that is still to be chosen."""

    names: tuple[str, ...]
    """The P controls."""
    values: FloatArray
    """(n, P); a row of NaN is no pose."""
    time: FloatArray | None = None
    """Seconds in the take's time, (n,); or"""
    frames: IntArray | None = None
    """the numbers of the frames, from 0, (n,), which count where both are there."""
    of_clock: bool = False
    """Whether the time is that of the recorder's clock, and not from the take's beginning."""
    limits: FloatArray | None = None  # (P, 2)
    where: str = "poses"
    """The file or argument that they are from, for messages."""

    def of_character(self, controls: Controls) -> Poses:
        """The poses in the order, the spelling and the limits of a character's controls.

        A control of which the character has a left and a right half moves both; those that the
        poses lack are 0 in them, and the log counts them.

        Raises `InputError` for a control that the character has not, with the nearest one, and for
        two that it has as one.
        """
        with reading(self.where):
            places = _places(self.names, controls, "names of the poses")
        values = _spread(self.values, places, len(controls.names))
        lacking = len(controls.names) - sum(map(len, places))
        if lacking:
            log.info(
                "%s: %s of the character %s not in it, and taken as 0",
                *(self.where, plural(lacking, "control"), "is" if lacking == 1 else "are"),
            )
        return replace(self, names=controls.names, values=values, limits=controls.limits)


def labelled(take: Take, poses: Poses) -> Take:
    """The take with these poses as labels, beside those that it has.

    By time, a pose belongs to the nearest frame, half a nominal frame away at most. Where the take
    has a pose already, the new one counts; poses that a model predicted are left out, and the log
    counts them.

    Raises `InputError` for a pose without a frame, two for one frame, no pose at all, or a take
    whose controls are others.
    """
    predicted = predicted_poses(take)
    if predicted:
        log.info("%s that a model predicted: left out", plural(predicted, "pose"))
        take = without_predicted(take)
    frames, controls, values = placed(take, poses)
    with reading(poses.where):
        _require_whole(frames, controls, values)
    params = np.full((len(take), len(controls.names)), np.nan)
    if take.params is not None and len(take.labels):
        params[:] = take.params
    params[frames] = values
    return take.with_poses(controls, params)


def placed(take: Take, poses: Poses) -> tuple[IntArray, Controls, FloatArray]:
    """The frames (n,) of a take that poses are for, its controls, and the poses' values, (n, P).

    Raises `InputError` as `labelled` does.
    """
    with reading(poses.where):
        poses = _known(poses)
        frames = _by_time(take, poses) if poses.frames is None else _by_number(take, poses)
        _require_different(frames)
        controls, order = _common_controls(take, poses)
        return frames, controls, poses.values[:, order]


def of_character(take: Take, controls: Controls) -> Take:
    """A take whose poses are those of a character's controls, see `Poses.of_character`."""
    if take.controls is None or take.controls.names == controls.names:
        return take if take.controls is None else replace(take, controls=controls)
    places = _places(take.controls.names, controls, "/target/names")
    spread = partial(_spread, places=places, count=len(controls.names))
    return take.with_controls(controls, spread)


def _places(names: Sequence[str], controls: Controls, field: str) -> list[list[int]]:
    """The control of a character, or the two halves, that each name stands for."""
    index = NameIndex.among(controls.names, names, field, halves=True)
    places = [index.find_halves(name) for name in names]
    unknown = [name for name, found in zip(names, places, strict=True) if not found]
    if unknown:
        meant = instead_of(unknown[0], controls.names)
        fix = f"Did you mean {meant}? " if meant else ""
        others = f", nor {listed(unknown[1:])}" if unknown[1:] else ""
        raise InputError(
            field,
            f"controls of the character ({len(controls.names)})",
            f"{unknown[0]!r}, which it has not{others}",
            f"{fix}Correct the name; if it moves a bone or an object, give --drivers as well; or "
            "leave out --rig: then any names count.",
        )
    taken: dict[int, str] = {}
    for name, found in zip(names, places, strict=True):
        for place in found:
            other = taken.setdefault(place, name)
            if other != name:
                both = f"{other!r} and {name!r} for {controls.names[place]!r}"
                raise InputError(field, "one name a control", both, "Leave one of them out.")
    return places


def _spread(values: FloatArray, places: Sequence[Sequence[int]], count: int) -> FloatArray:
    """Values (n, p) of controls at their places among others, (n, count), which are 0."""
    spread = np.zeros((len(values), count))
    for column, found in enumerate(places):
        spread[:, list(found)] = values[:, [column]]
    unposed = np.isnan(values).all(axis=1)
    spread[unposed] = np.nan
    return spread


def _known(poses: Poses) -> Poses:
    """Rows of the poses that are known, with their names checked."""
    names = checked_names(poses.names, poses.values.shape[1], "names of the controls")
    known = np.asarray(~np.isnan(poses.values).all(axis=1))
    if not known.any():
        raise InputError("rows", "a pose at least", "none", "Write a row for each posed frame.")
    return replace(
        poses,
        names=names,
        values=poses.values[known],
        time=None if poses.time is None else poses.time[known],
        frames=None if poses.frames is None else poses.frames[known],
    )


def _by_number(take: Take, poses: Poses) -> IntArray:
    assert poses.frames is not None  # poses without a time have frames
    outside = poses.frames[(poses.frames < 0) | (poses.frames >= len(take))]
    if len(outside):
        last = len(take) - 1
        raise InputError("column frame", f"0 to {last}", f"{outside[0]}", "Count from 0.")
    if poses.time is not None:
        _compare(take, poses, poses.frames)
    return poses.frames


def _compare(take: Take, poses: Poses, frames: IntArray) -> None:
    """Warn where the times of the poses lie in the take, and name other frames."""
    assert poses.time is not None
    places, late = _nearest(take, _in_take(take, poses))
    off = np.abs(places - frames)
    if (late <= 0).all() and off.max() > 1:
        row = int(off.argmax())
        log.warning(
            "%s: %s by number and by time at different frames, such as %d and %d: the numbers are "
            "taken; to go by time, leave that column out",
            *(poses.where, plural(int((off > 1).sum()), "pose"), frames[row], places[row]),
        )


def _by_time(take: Take, poses: Poses) -> IntArray:
    """Index of the frame nearest in time to each pose."""
    assert poses.time is not None
    time = _in_take(take, poses)
    frames, distance = _nearest(take, time)
    astray = np.flatnonzero(~(distance <= 0))
    if len(astray):
        row, zero = astray[0], poses.time[astray[0]] - time[astray[0]]
        expected, near = "within half a frame of one of the take", take.time[frames[row]] + zero
        fix = "Count seconds as the take does, or give a column frame."
        in_ms = replace(poses, time=poses.time / 1e3, of_clock=False)
        if (_nearest(take, _in_take(take, in_ms))[1] <= 0).all():
            fix = "If they are milliseconds, call the column time_ms."
        found = f"{poses.time[row]:.3f} s"
        raise InputError("time of the poses", f"{expected}, such as {near:.3f} s", found, fix)
    return frames


def _in_take(take: Take, poses: Poses) -> FloatArray:
    """Times of the poses from the take's beginning, where they are those of its clock as well."""
    assert poses.time is not None
    start = take.clock_start
    by_clock = poses.time - start
    if poses.of_clock or not start:
        return by_clock
    fits, fits_clock = ((_nearest(take, one)[1] <= 0).all() for one in (poses.time, by_clock))
    if fits_clock:
        taken = f"from its first frame on, not by its clock, which begins at {start:.10g} s"
        taken = taken if fits else f"by the take's clock, which begins at {start:.10g} s"
        log.warning("%s: times of the poses are taken %s", poses.where, taken)
    return by_clock if fits_clock and not fits else poses.time


def _nearest(take: Take, time: FloatArray) -> tuple[IntArray, FloatArray]:
    """The frames nearest to times (n,), and the seconds by which these are too far from them."""
    frames = nearest_frames(take.time, time)
    return frames, np.abs(take.time[frames] - time) - (0.5 / take.fps + 1e-6)


def _require_different(frames: IntArray) -> None:
    found, counts = np.unique(frames, return_counts=True)
    if (counts > 1).any():
        twice = found[counts > 1][0]
        raise InputError("rows", "one pose a frame", f"two for {twice}", "Remove one of them.")


def _require_whole(frames: IntArray, controls: Controls, values: FloatArray) -> None:
    """Refuse poses (n, P) of frames that lack the value of a control."""
    lacking = np.argwhere(np.isnan(values))
    if len(lacking):
        row, column = lacking[0].tolist()
        expected, found = (
            "a value for every control",
            f"none for {controls.names[column]!r}: known in part",
        )
        fix = "Write 0 for a control at rest; a row without any number is no pose."
        raise InputError(f"pose of frame {frames[row]}", expected, found, fix)


def _common_controls(take: Take, poses: Poses) -> tuple[Controls, IntArray]:
    """Controls of take and poses, and the column of each in the poses."""
    if take.controls is None or (not len(take.labels) and take.animation is None):
        return Controls(poses.names, poses.limits), np.arange(len(poses.names))
    controls = take.controls
    order = match(controls.names, poses.names, "names of the poses")
    if len(order) != len(poses.names):
        others = [name for i, name in enumerate(poses.names) if i not in set(order.tolist())]
        expected, found = f"the take's {len(controls.names)} controls", f"also {listed(others)}"
        fix = "Pose the same controls, or give the character's to all poses with --rig."
        raise InputError("names of the poses", expected, found, fix)
    if controls.limits is None and poses.limits is not None:
        controls = replace(controls, limits=poses.limits[order])
    return controls, order


def poses_of(take: Take) -> Poses:
    """The poses of another take by their times; of one without poses, its weights.

    Raises `InputError` when it has markers only.
    """
    names, values = named_curves(take)
    limits = None if take.controls is None or take.params is None else take.controls.limits
    return Poses(names, values, take.time, limits=limits)


def weights_as_poses(take: Take, rig: Shaped) -> Take:
    """The take with its tracked weights as the poses of a rig that has shapes of their names.

    Weights without a shape are left out, and the log names them. A frame with a weight that was
    not observed has no pose.

    Raises `InputError` when the source is markers, no weight has a shape, or no frame is observed
    as a whole.
    """
    poses = poses_of(take)
    index = NameIndex.among(rig.names, poses.names, "/source/names", halves=True)
    kept = [i for i, name in enumerate(poses.names) if index.find_halves(name)]
    if not kept:
        found = f"{poses.names[0]!r} and others"
        raise InputError("/source/names", "names of the rig's shapes", found, "Give another rig.")
    left_out = [name for i, name in enumerate(poses.names) if i not in set(kept)]
    if left_out:
        weights = plural(len(left_out), "weight")
        log.warning("no shape for %s, left out: %s", weights, ", ".join(left_out))
    values = poses.values[:, kept]
    whole = np.asarray(~np.isnan(values).any(axis=1))
    if not whole.any():
        found = "gaps in every frame"
        raise InputError("/source/weights", "a whole frame", found, "Fill them: facert clean.")
    controls = Controls(tuple(poses.names[i] for i in kept))
    params = np.where(whole[:, None], values, np.nan)
    return replace(take.with_poses(controls, params), animation=None)


def predicted_frames(take: Take) -> IntArray:
    """The posed frames whose pose a model predicted: it has a standard deviation.

    Of a result that names its model, and of one with corrections, these are all that nobody
    corrected, whether the method had deviations or not.
    """
    if take.corrections is not None:
        return np.setdiff1d(take.labels, take.corrections.frames)
    if take.std is None:
        return take.labels if take.model else take.labels[:0]
    return take.labels[(take.std[take.labels] > 0).any(axis=1)]


def predicted_poses(take: Take) -> int:
    """Number of posed frames that a model predicted."""
    return len(predicted_frames(take))


def without_predicted(take: Take) -> Take:
    """The take with the poses alone that somebody set."""
    frames = predicted_frames(take)
    if take.params is None:
        return take
    params = take.params.copy()
    params[frames] = np.nan
    return take.with_poses(take.controls, params)
