"""Converting one file to another, as `convert` does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from facert.cli.shared import console
from facert.cli.shared.files import warn_of_unit
from facert.data.changes import Changes, converted, in_space
from facert.data.drivers import Drivers
from facert.data.labelling import weights_as_poses
from facert.data.limits import rig_controls
from facert.data.rig import Rig, Shaped
from facert.data.take import Controls, Take
from facert.data.text import plural
from facert.errors import InputError, reading
from facert.io import formats
from facert.io.gltf.carried import CarriedFile
from facert.io.gltf.character import Character
from facert.io.mesh_sequence import holds_mesh_sequence, open_mesh_sequence
from facert.io.npz import NO_TARGET
from facert.io.registry import (
    GLTF_ENDINGS,
    OWN_ENDINGS,
    Kind,
    format_of,
    output_format,
    require_output,
    write,
)
from facert.mesh.morphs import Morphs, compact_morphs, moving_morphs, rig_morphs
from facert.preprocess.label_checks import warn_of_labels
from facert.render.faces import control_settings, require_poses

KINDS: tuple[Kind, ...] = ("take", "rig", "morphs")
"""What a file can be converted to."""


@dataclass(frozen=True)
class Wanted:
    """Options of reading the input, see `facert.io.formats.read_any`, and the rig of a take."""

    kind: formats.TakeOrRig | None = None
    target: str | None = None
    shapes: str | None = None
    fps: float | None = None
    or_fps: float | None = None
    rig: Path | None = None
    drivers: Drivers | None = None
    keep: tuple[str, ...] = ()
    align: bool = False


def convert_file(
    source: Path, output: Path, wanted: Wanted, changes: Changes, overwrite: bool
) -> None:
    """Convert a file, and print what was written.

    Raises
    ------
    InputError
        When the input is bad, or the output cannot hold it.
    OutputExistsError
        When `output` exists and `overwrite` is not set.
    """
    console.show(f"{output}: {_convert(source, output, wanted, changes, overwrite)}")


def _convert(source: Path, output: Path, wanted: Wanted, changes: Changes, overwrite: bool) -> str:
    of_morphs = "morphs" in require_output(output, overwrite, *KINDS).write
    if holds_mesh_sequence(source):
        return _convert_sequence(source, output, _is_plain(wanted, changes), overwrite)
    if _is_copy(source, output, wanted, changes):
        with reading(source):
            CarriedFile(source).write(output, overwrite)
        return f"the character as in {source.name}"
    found = _read(source, output, wanted, changes)
    if wanted.rig is not None and not of_morphs:
        changes = replace(changes, controls=_controls(wanted.rig, wanted.shapes, wanted.drivers))
    with reading(source):
        found = converted(found, changes)
        if isinstance(found, Take) and (changes.poses or changes.controls or changes.limits):
            warn_of_labels(found)
        if isinstance(found, Rig):
            return _write_rig(found, output, overwrite)
        if of_morphs:
            return _write_moved(found, output, wanted, changes, overwrite)
    count = formats.write_take_file(found, output, overwrite)
    return _content(found, count, output)


@lru_cache(1)
def _controls(rig: Path, shapes: str | None, drivers: Drivers | None) -> Controls:
    """The controls of a character: its shapes, and what else it has drivers for."""
    with reading(rig):
        found = formats.read_rig_file(rig, shapes)
    return rig_controls(found, () if drivers is None else drivers.controls)


def _content(take: Take, count: int, output: Path) -> str:
    """Description of what of a take was written: all, the poses, or else the source."""
    frames = plural(count, "frame")
    source = plural(len(take.source.names), take.source.kind[:-1])
    poses = plural(len(take.labels), "pose")
    if output.suffix.lower() in OWN_ENDINGS:
        return f"a take with {frames} of {source} and {poses}"
    if take.controls is None or take.params is None:
        return f"{frames} of {source}"
    return f"{poses} of {plural(len(take.controls.names), 'control')}"


def _read(source: Path, output: Path, wanted: Wanted, changes: Changes) -> Take | Rig:
    """The take or the rig of a file; of one with both, the take where only that makes sense."""
    kind = wanted.kind
    no_rig = not output_format(output, *KINDS).write.keys() & {"rig", "morphs"}
    if kind is None and (wanted.rig or wanted.fps or changes.of_frames or no_rig):
        kind = "take"
    target = wanted.target
    if target is None and changes.poses is not None and formats.targets_of(source):
        console.log.info("%s: of its targets none is read: --target chooses", source.name)
        target = NO_TARGET
    options = (target, wanted.shapes, wanted.fps, kind, wanted.or_fps)
    return formats.read_any(source, *options, wanted.keep, wanted.align)


def _convert_sequence(source: Path, output: Path, plain: bool, overwrite: bool) -> str:
    if not plain:
        expected, found = "none that change a take", "a mesh sequence"
        raise InputError("options", expected, found, "Leave them out.", str(source))
    require_output(output, overwrite, "morphs")
    with open_mesh_sequence(source) as sequence:
        morphs = compact_morphs(sequence)
    return _write_motion(morphs, output, overwrite)


def _is_plain(wanted: Wanted, changes: Changes) -> bool:
    """Whether nothing is to be changed."""
    return changes == Changes() and not wanted.fps


def _is_copy(source: Path, output: Path, wanted: Wanted, changes: Changes) -> bool:
    """Whether a character alone is asked for, and as it is."""
    other = wanted.kind == "take" or wanted.rig or wanted.shapes
    return not other and _is_plain(wanted, changes) and _is_carried(source, output)


def _is_carried(character: Path, output: Path) -> bool:
    """Whether a character's file is of the output's own format, so that it stays as it is."""
    found = format_of(character, "read", "rig")
    of_gltf = found is not None and set(found.endings) <= set(GLTF_ENDINGS)
    return of_gltf and output.suffix.lower() == ".glb"


def _write_moved(
    take: Take, output: Path, wanted: Wanted, changes: Changes, overwrite: bool
) -> str:
    """Write a character in the poses of a take, or as its tracked weights move it."""
    if wanted.rig is None:
        raise InputError("--rig", "the character's rig", "none", "Give it with --rig.")
    if _is_carried(wanted.rig, output):
        with reading(wanted.rig):
            character = Character(wanted.rig, wanted.shapes, wanted.drivers)
        posed = _posed(take, character)
        poses, controls = require_poses(posed), posed.controls
        assert controls is not None  # poses come with controls
        return character.write(controls.names, poses, posed.time, output, overwrite)
    if wanted.drivers is not None:
        console.log.warning("%s holds shapes alone: what drivers move stays at rest", output.name)
    morphs = _motion(take, wanted.rig, wanted, changes)
    morphs = morphs if output.suffix.lower() == ".glb" else moving_morphs(morphs)
    return _write_motion(morphs, output, overwrite)


def _motion(take: Take, path: Path, wanted: Wanted, changes: Changes) -> Morphs:
    """The rig in the poses of a take."""
    with reading(path):
        rig = formats.read_rig_file(path, wanted.shapes, wanted.drivers)
        # `--in-units` is the unit of IN: a rig that states its own unit keeps that, and in any case
        # its own up axis.
        stated = rig.units or changes.in_units
        in_unit = in_space(rig, Changes(in_units=stated, units=changes.units))
    assert isinstance(in_unit, Rig)  # as it went in
    take = _posed(take, in_unit)
    settings = control_settings(take, in_unit, range(len(take)))
    return rig_morphs(in_unit, settings, take.time, take.fps)


def _posed(take: Take, rig: Shaped) -> Take:
    """The take; of one with tracked weights and no poses, those as poses."""
    if not len(take.labels) and take.source.kind == "weights":
        return weights_as_poses(take, rig)
    return take


def _write_rig(rig: Rig, output: Path, overwrite: bool) -> str:
    if "morphs" in require_output(output, overwrite, "rig", "morphs").write:
        rest = np.zeros((1, len(rig.names)))
        still = Morphs(rig.mesh, rig.shapes, rig.names, rest, np.zeros(1))
        _write_motion(still, output, overwrite)
    else:
        formats.write_rig_file(rig, output, overwrite)
    vertices = plural(len(rig.neutral), "vertex", "vertices")
    return f"a rig with {vertices} and {plural(len(rig.names), 'shape')}"


def _write_motion(morphs: Morphs, output: Path, overwrite: bool) -> str:
    warn_of_unit(morphs.neutral.units)
    write("morphs", morphs, output, overwrite)
    error = f", off by {morphs.error:.2g} at most" if morphs.error else ""
    targets = plural(len(morphs.targets), "morph target")
    return f"{plural(len(morphs.time), 'frame')} of {targets}{error}"
