"""What converting a take or a rig changes in it, besides the format of its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from facert.data.labelling import Poses, labelled
from facert.data.name_map import renamed
from facert.data.resampling import resampled
from facert.data.rig import Rig
from facert.data.take import Take
from facert.data.timecode import timecode
from facert.data.units import with_units, with_up_axis
from facert.errors import InputError


@dataclass(frozen=True)
class Changes:
    """What to change; None and empty: keep it.

    Parameters
    ----------
    names : mapping
        From names in the file to new ones, see `facert.data.name_map.renamed`.
    poses : Poses, optional
        Labels to add, by the frames and times of the file.
    fps : float, optional
        Frames a second to resample to.
    in_units, in_up_axis : str
        What the numbers in the file are in, whatever it says.
    units, up_axis : str
        What to convert them to.
    start_timecode : str
        ``HH:MM:SS:FF`` of the first frame, FF at the new rate.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    poses: Poses | None = None
    fps: float | None = None
    in_units: str = ""
    units: str = ""
    in_up_axis: str = ""
    up_axis: str = ""
    start_timecode: str = ""

    @property
    def of_frames(self) -> tuple[str, ...]:
        """The options among them that only a take can follow."""
        asked = {
            "--poses": self.poses,
            "--fps": self.fps,
            "--start-timecode": self.start_timecode,
        }
        return tuple(option for option, value in asked.items() if value)


def converted(found: Take | Rig, changes: Changes) -> Take | Rig:
    """The take or rig with the changes: names, then poses, then space, then time.

    Raises
    ------
    InputError
        For a change that cannot be made, naming its option.
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
    if changes.poses is not None:
        take = labelled(take, changes.poses)
    if changes.fps is not None:
        take = resampled(take, changes.fps)
    start = changes.start_timecode
    if start and not timecode(start, 0.0, take.fps):
        raise InputError("--start-timecode", "HH:MM:SS:FF", repr(start), "Correct it.")
    return replace(take, start_timecode=start) if start else take
