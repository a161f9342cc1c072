"""A whole pose of a character from names and values of some of its controls: `complete_pose`."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.limits import bounds_of
from facert.data.names import NameIndex, fitting_some, instead_of, match
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.posing.completion import Completion
from facert.posing.correction import correct
from facert.preprocess.known_poses import Given, KnownPoses, keep
from facert.retarget.retargeter import Retargeter

log = logging.getLogger(__name__)

LEAST = 3  # known poses
FAR = 0.5  # from every known pose, in mean distances of two of them
BEYOND = 1e-9  # of a control's range: rounding


@dataclass(frozen=True, eq=False)
class CompletedPose:
    """A whole pose of a character, completed from some of its controls.

    Parameters
    ----------
    controls : Controls
        P of them.
    given : mapping of str to float
        What was asked for, by the names of the controls.
    pose, std : arrays, shape (P,)
        The most probable pose, and the standard deviation of each control.
    samples : array, shape (N, P)
        Other plausible poses.
    held : tuple of str
        The controls that kept their value.
    corrected : Take, optional
        The retargeted frame that was corrected.
    far : bool
        No known pose comes near the given values: the others are a guess.
    """

    controls: Controls
    given: Mapping[str, float]
    pose: FloatArray
    std: FloatArray
    samples: FloatArray
    held: tuple[str, ...] = ()
    corrected: Take | None = None
    far: bool = False

    @property
    def as_dict(self) -> dict[str, Any]:
        """The fields by name, as plain values."""
        when = {} if self.corrected is None else {"time": float(self.corrected.time[0])}
        return when | {
            "given": dict(self.given),
            "held": list(self.held),
            "pose": self._named(self.pose),
            "std": self._named(self.std),
            "samples": [self._named(sample) for sample in self.samples],
        }

    @property
    def as_take(self) -> Take:
        """A take with a pose a frame, the most probable one first; its source is what was given.

        A corrected pose has the time of its frame, and no standard deviation: it is somebody's.
        """
        poses = np.vstack([self.pose, self.samples])
        std = np.full_like(poses, np.nan)
        std[0] = self.std
        values = np.tile(list(self.given.values()), (len(poses), 1))
        made = Take(
            time=np.arange(len(poses), dtype=np.float64),
            source=Source(values, tuple(self.given)),
            controls=self.controls,
            params=poses,
            std=std,
            fps=1.0,
        )
        if self.corrected is None:
            return made
        return replace(made, time=made.time + self.corrected.time[0], std=None)

    def _named(self, values: FloatArray) -> dict[str, float]:
        return dict(zip(self.controls.names, values.tolist(), strict=True))


def complete_pose(
    character: Retargeter | Take,
    given: Mapping[str, float],
    *,
    soft: float = 0.0,
    samples: int = 0,
    seed: int = 0,
    start: Take | None = None,
    hold: Sequence[str] = (),
) -> CompletedPose:
    """The most probable whole pose of a character, given some of its controls.

    What poses are probable is learned from those that the character is known to make: the labels
    and the animation that a model was trained on, or those of a take.

    Parameters
    ----------
    character : Retargeter or Take
        Where the known poses come from.
    given : mapping of str to float
        Values of some controls, named in any spelling.
    soft : float
        Standard deviation of the values, in the controls' own units: the pose may be so far from
        them. At 0 it meets them exactly.
    samples : int
        Number of other plausible poses to draw.
    seed : int
        For them.
    start : Take, optional
        One frame that was retargeted to this character: the values then correct its pose, see
        `facert.posing.correction`.
    hold : sequence of str
        Controls, or patterns such as ``"mouth*"``, that keep the value of `start` unless they are
        given another.

    Raises
    ------
    InputError
        For unknown names (with the nearest one), values outside of declared limits, controls to
        hold without a start, or a character with fewer than three known poses.
    """
    controls, known = known_poses(character)
    asked = given_controls(controls, given, soft)
    if samples < 0:
        raise InputError("samples", "a number from 0", f"{samples}", "Ask for some, or for none.")
    held = _held(controls.names, hold, asked)
    rng = np.random.default_rng(seed)
    completion = Completion.learn(known, asked.controls)
    far = _warn_if_far(controls, completion, asked)
    if start is not None:
        posed = correct(*_start(start, controls), known, asked, samples, rng, held)
    elif len(held):
        raise InputError("hold", "a frame to keep the values of", "none", "Give --from TAKE:FRAME.")
    else:
        posed = completion.pose(asked, samples, rng)
    names = np.array(controls.names, dtype=np.object_)
    named = dict(zip(names[asked.controls], asked.values.tolist(), strict=True))
    kept = tuple(names[held])
    return CompletedPose(controls, named, posed.pose, posed.std, posed.samples, kept, start, far)


def known_poses(character: Retargeter | Take) -> tuple[Controls, KnownPoses]:
    """A character's controls, and the poses that it is known to make.

    Raises
    ------
    InputError
        When there are fewer than three.
    """
    controls, bounds = character.controls, None
    if isinstance(character, Take):
        poses = _poses_of(character)
    else:
        poses, bounds = character.poses, character.bounds
    if poses is None or controls is None or len(poses) < LEAST:
        found = "none" if poses is None else f"{len(poses)}"
        fix = "Train the model again, or give a take with poses."
        raise InputError("poses of the character", f"at least {LEAST}", found, fix)
    if bounds is None:
        bounds = bounds_of(controls.limits, poses)
    return controls, KnownPoses(keep(poses, None, seed=0), bounds)


def _poses_of(take: Take) -> FloatArray | None:
    if take.params is not None and len(take.labels):
        return keep(take.params[take.labels], take.animation, seed=0)
    return take.animation


def given_controls(controls: Controls, wanted: Mapping[str, float], soft: float = 0.0) -> Given:
    """The given ones of a character's controls, with their values.

    Raises
    ------
    InputError
        When there are none; for an unknown name, with the nearest one; for a value that is no
        number or outside of declared limits.
    """
    if not wanted:
        raise InputError("given controls", "at least one", "none", "Set a control to a value.")
    if not (math.isfinite(soft) and soft >= 0.0):
        raise InputError("soft", "a standard deviation from 0", f"{soft}", "Give another.")
    index = NameIndex.among(controls.names, list(wanted), "given controls")
    for name in wanted:
        if index.find(name) is None:
            fix = _did_you_mean(name, controls.names)
            raise InputError("--set", "the name of a control", repr(name), fix)
    positions = index.places(list(wanted), "given controls")
    values = np.array(list(wanted.values()), dtype=np.float64)
    for name, position, value in zip(wanted, positions, values, strict=True):
        low, high = (-np.inf, np.inf) if controls.limits is None else controls.limits[position]
        slack = BEYOND * (high - low) if math.isfinite(high - low) else 0.0
        if not math.isfinite(value):
            raise InputError(name, "a number", f"{value:g}", "Give another value.")
        if not low - slack <= value <= high + slack:
            raise InputError(
                name, f"a value from {low:g} to {high:g}", f"{value:g}", "Keep to its limits."
            )
    return Given(positions, values, soft)


def _held(names: tuple[str, ...], patterns: Sequence[str], given: Given) -> IntArray:
    """The controls that fit a pattern and are not given, rising."""
    found: set[int] = set()
    for pattern in patterns:
        found.update(fitting_some(pattern, names, "--hold"))
    return np.setdiff1d(np.array(sorted(found), dtype=np.int64), given.controls)


def _did_you_mean(name: str, names: tuple[str, ...]) -> str:
    meant = instead_of(name, names)
    return f"Did you mean {meant}?" if meant else f"There are {', '.join(names)}."


def _warn_if_far(controls: Controls, completion: Completion, given: Given) -> bool:
    """Warn where known poses do not reach: there the prediction is no more than a guess."""
    known = completion.known.poses
    low, high = known.min(axis=0), known.max(axis=0)
    for index, value in zip(given.controls, given.values, strict=True):
        name, slack = controls.names[index], BEYOND * (high[index] - low[index])
        if high[index] - low[index] <= BEYOND * max(abs(low[index]), 1.0):
            log.warning("%s never moves in the known poses: the others do not follow it", name)
        elif not low[index] - slack <= value <= high[index] + slack:
            text = "%s: %.3g is outside the range of the known poses (%.3g to %.3g)"
            log.warning(text, name, value, low[index], high[index])
    far = completion.farness(given.values) > FAR
    if far:
        log.warning("no known pose comes near the given values: the others are a guess")
    return far


def _start(take: Take, controls: Controls) -> tuple[FloatArray, FloatArray | None]:
    """The one pose of a take, and its standard deviation where it has one."""
    if take.controls is None or take.params is None or len(take.params) != 1:
        raise InputError("start", "one frame with a pose", f"{len(take)} frames", "Retarget one.")
    columns = match(controls.names, take.controls.names, "start: /target/names")
    if take.std is None or np.isnan(take.std).any():  # somebody's pose has none
        return take.params[0, columns], None
    return take.params[0, columns], take.std[0, columns]
