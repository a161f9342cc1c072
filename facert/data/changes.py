"""Changes of a take or a rig, as `convert` makes them: names, poses, unit and axis, rate."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

from facert.data.labelling import Poses, labelled, of_character
from facert.data.limits import StatedLimits, with_limits
from facert.data.names import NameIndex, nearest
from facert.data.rate import BROKEN, standard_rate, whole_count
from facert.data.resampling import resampled
from facert.data.rig import Rig
from facert.data.spelling import composed, contrasted
from facert.data.take import Controls, Take
from facert.data.timecode import can_drop, is_dropped, is_marked_drop, timecode
from facert.data.units import with_units, with_up_axis
from facert.errors import InputError

log = logging.getLogger("facert")


@dataclass(frozen=True)
class Changes:
    """Requested changes to a take or rig; what is None or empty is kept."""

    names: Mapping[str, str] = field(default_factory=dict)
    """From names in the file to new ones, see `renamed`."""
    poses: Poses | None = None
    """Labels to add, by the frames and times of the file."""
    controls: Controls | None = None
    """The character's, whose names, order and limits the poses are to have."""
    limits: tuple[StatedLimits, ...] = ()
    """Limits of controls that somebody states."""
    fps: float | None = None
    """Frames a second to resample to."""
    in_units: str = ""
    in_up_axis: str = ""
    """What the numbers in the file are in, whatever it states."""
    units: str = ""
    up_axis: str = ""
    """What to convert them to."""
    start_timecode: str = ""
    """``HH:MM:SS:FF``, or drop-frame ``HH:MM:SS;FF``, of the first frame at the new rate."""

    @property
    def of_frames(self) -> tuple[str, ...]:
        """The requested options that apply to takes only."""
        asked = {
            "--poses": self.poses,
            "--limits": self.limits,
            "--fps": self.fps,
            "--start-timecode": self.start_timecode,
        }
        return tuple(option for option, value in asked.items() if value)


def converted(found: Take | Rig, changes: Changes) -> Take | Rig:
    """The take or rig with the changes: names, then poses, then space, then time.

    Raises `InputError` for a change that cannot be made, naming its option.
    """
    if changes.names:
        found = renamed(found, changes.names)
    found = in_space(found, changes)
    if isinstance(found, Take):
        return _in_time(found, changes)
    if changes.of_frames:
        found_instead = "a rig, which has no frames"
        raise InputError(changes.of_frames[0], "a take", found_instead, "Leave it out.")
    return found


def in_space(found: Take | Rig, changes: Changes) -> Take | Rig:
    """The take or rig with the changes of unit and axis alone."""
    if changes.in_units:
        found = replace(found, units=changes.in_units)
    if changes.units:
        found = with_units(found, changes.units)
    present = changes.in_up_axis or ("" if isinstance(found, Rig) else found.up_axis)
    if changes.up_axis:
        return with_up_axis(found, changes.up_axis, present)
    if changes.in_up_axis:
        return with_up_axis(found, changes.in_up_axis, changes.in_up_axis)
    return found


def _in_time(take: Take, changes: Changes) -> Take:
    take = _posed(take, changes)
    if changes.fps is not None:
        take = resampled(take, standard_rate(changes.fps))
    if not changes.start_timecode:
        return take
    return replace(take, start_timecode=_start_timecode(changes.start_timecode, take.fps))


def _posed(take: Take, changes: Changes) -> Take:
    """The take with the poses, the names and the limits that are asked for."""
    poses, controls = changes.poses, changes.controls
    if controls is not None:
        take = of_character(take, controls)
        poses = None if poses is None else poses.of_character(controls)
    if poses is not None:
        take = labelled(take, poses)
    if poses or controls or changes.limits:
        return with_limits(take, changes.limits, of_rig=controls is not None)
    return take


def _start_timecode(start: str, fps: float) -> str:
    """The timecode that was asked for, as it is kept; a number that there is not is refused."""
    expected, fix = "HH:MM:SS:FF, or drop-frame HH:MM:SS;FF", "Correct it."
    written = timecode(start, 0.0, fps)
    if not written or is_dropped(start, fps):
        expected = "a number that drop-frame has" if written else expected
        raise InputError("--start-timecode", expected, repr(start), fix)
    if not is_marked_drop(start):
        return start
    if not can_drop(whole_count(fps)):
        fix = "Write a colon before FF, or give --in-fps 29.97."
        raise InputError("--start-timecode", f"HH:MM:SS:FF at {fps:g}/s", repr(start), fix)
    if fps not in BROKEN:
        log.warning("drop-frame is for 29.97 frames/s and the like: this take has %g", fps)
    return written


def renamed(found: Take | Rig, names: Mapping[str, object]) -> Take | Rig:
    """A take or rig with its names replaced.

    `names` goes from those in the file, in any spelling, to the new ones; ``"Face:*"`` to ``"*"``
    removes a prefix from all that have it; of two patterns that fit a name the first counts. Of a
    take the markers or weights and the controls are renamed. What is not in the mapping keeps its
    name.

    Raises `InputError` for a name that the file does not have, with the nearest one that it has,
    and for two that would bear one name.
    """
    for theirs, ours in names.items():
        if not isinstance(ours, str):
            expected = 'a name, as in theirs = "ours"'
            raise InputError(f"--map: {theirs}", expected, repr(ours), "Correct the map.")
    new = {theirs: str(ours) for theirs, ours in names.items()}
    if isinstance(found, Rig):
        (shapes,) = _renamed([found.names], new)
        return replace(found, names=shapes)
    controls = found.controls
    lists = [found.source.names, controls.names if controls else ()]
    source_names, control_names = _renamed(lists, new)
    source = replace(found.source, names=source_names)
    if controls is not None:
        controls = Controls(control_names, controls.limits)
    return replace(found, source=source, controls=controls)


def _renamed(lists: Sequence[tuple[str, ...]], names: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Lists of names with those in a mapping replaced; all of it must be in one of them."""
    there = tuple(dict.fromkeys(chain(*lists)))
    patterns = {key: ours for key, ours in names.items() if "*" in key and key not in there}
    plain = {theirs: ours for theirs, ours in names.items() if theirs not in patterns}
    fitting = _fitting(patterns, there)
    index = NameIndex.among(there, list(plain), "--map")
    _require_known([name for name in plain if index.find(name) is None], there)
    result = []
    for present in lists:
        new = [fitting.get(name, name) for name in present]
        index = NameIndex.among(present, list(plain), "--map", quiet=True)
        for theirs, ours in plain.items():
            place = index.find(theirs)
            if place is not None:
                new[place] = ours
        result.append(tuple(new))
    return result


def _require_known(unknown: Sequence[str], there: Sequence[str]) -> None:
    """Refuse names that are nowhere in the file."""
    if unknown:
        near = nearest(unknown[0], there)
        more = f" ({len(unknown) - 1} more)" if len(unknown) > 1 else ""
        expected = f"names in the file, such as {near or there[0]!r}"
        fix = f"Did you mean {contrasted(near, unknown[0])}?" if near else "Correct the map."
        raise InputError("--map", expected, f"{unknown[0]!r}{more}", fix)


def _fitting(patterns: Mapping[str, str], there: Sequence[str]) -> dict[str, str]:
    """The new names of those that fit a pattern, the first one: what its * stands for is kept."""
    new: dict[str, str] = {}
    for pattern, ours in patterns.items():
        if pattern.count("*") != 1 or ours.count("*") != 1:
            expected = 'one * on either side, as in "Face:*" = "*"'
            raise InputError("--map", expected, f"{pattern!r} = {ours!r}", "Correct the map.")
        before, after = map(composed, pattern.split("*"))
        kept = re.compile(f"{re.escape(before)}(.+){re.escape(after)}", re.DOTALL)
        matches = {name: kept.fullmatch(composed(name)) for name in there}
        found = {name: ours.replace("*", one[1]) for name, one in matches.items() if one}
        _require_known([] if found else [pattern], there)
        new = found | new
    return new
