"""``facert convert``: any format to another."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from facert.cli.shared.batch import carry_out, plan
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    AXES,
    DRIVERS,
    ENDING,
    JOBS,
    LENGTH_UNITS,
    OUT_DIR,
    OVERWRITE,
    SHAPES,
    argument,
    file_option,
    option,
)
from facert.io.registry import listed


def command(
    paths: Annotated[
        list[Path],
        argument(
            "IN OUT",
            f"IN: a take ({listed('read', 'take')}), a rig ({listed('read', 'rig')}, folder of"
            f" .obj) or a mesh sequence. OUT, by whose ending the format is chosen:"
            f" {listed('write', 'take')}; {listed('write', 'morphs')} for a rig, and with --rig for"
            " a take. With --out-dir: any number of files, or folders of takes.",
        ),
    ],
    kind: Annotated[
        Literal["take", "rig"] | None,
        option("What to read of a .glb that holds both; else the rig."),
    ] = None,
    target: Annotated[
        str | None,
        file_option("Which target of an .npz track, or animation of a .glb, IN or --poses."),
    ] = None,
    shapes: SHAPES = None,
    map_path: Annotated[
        Path | None,
        file_option(
            'New names: theirs = "ours"; "Face:*" = "*" removes a prefix.', "--map", metavar="TOML"
        ),
    ] = None,
    poses_path: Annotated[
        Path | None,
        file_option("Labels from another file, by its column frame or by time.", "--poses"),
    ] = None,
    limits: Annotated[
        list[str] | None,
        file_option(
            "Limits of the controls: LO..HI, NAME=LO..HI (also 'mouth*=0..1') or none; repeatable."
            " By default those of --rig, else 0..1 where all poses keep to it.",
            metavar="LIMITS",
        ),
    ] = None,
    in_fps: Annotated[
        float | None,
        option("Frames a second of IN, whatever it states: frames are counted anew.", min=1e-3),
    ] = None,
    fps: Annotated[
        float | None,
        option("Frames a second of OUT: resampled by time, every frame of that rate.", min=1e-3),
    ] = None,
    keep: Annotated[
        list[str] | None,
        option("A column of IN to keep that looks like a clock, a counter or a flag; repeatable."),
    ] = None,
    in_units: Annotated[
        str,
        option("Unit of IN, instead of the one it states.", autocompletion=LENGTH_UNITS),
    ] = "",
    units: Annotated[
        str,
        option(
            "Unit of OUT: m, dm, cm, mm, in or ft; numbers are converted.",
            autocompletion=LENGTH_UNITS,
        ),
    ] = "",
    in_up_axis: Annotated[
        str, option("The axis up in IN, instead of the one it states.", autocompletion=AXES)
    ] = "",
    up_axis: Annotated[
        str, option("The axis up in OUT: y, z or x; turned.", autocompletion=AXES)
    ] = "",
    start_timecode: Annotated[
        str, option("Of the first frame, HH:MM:SS:FF; drop-frame HH:MM:SS;FF.")
    ] = "",
    align_shapes: Annotated[
        bool,
        option("Move, turn and scale .obj that are not in register with neutral.obj."),
    ] = False,
    rig_path: Annotated[
        Path | None,
        file_option("The character's rig: names and limits of poses; the mesh.", "--rig"),
    ] = None,
    drivers_path: DRIVERS = None,
    out_dir: OUT_DIR = None,
    ending: ENDING = None,
    jobs: JOBS = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Convert a take, a rig or a mesh sequence to another format.

    Shapes are matched by name in any spelling. Columns that are a clock, a counter, a confidence
    or a flag are used as such, or left out and named, unless --keep names them. Rows without a face
    are dropped and counted.
    A .csv or .json holds the poses when there are any, else the source. A .glb or .usd holds the
    rig that a take moves, or the few morph targets that move a mesh as its sequence does; a .glb of
    a character in a .glb, .gltf or .vrm is that file as it is, with the animation added. What IN
    does not state of its rate, unit or axis is taken to be as OUT's.
    With --rig, poses have the names, the order and the limits of its controls: a name that it lacks
    is refused, a control that the poses lack is 0.

    facert convert retargeted.h5 curves.csv
    facert convert retargeted.h5 face.glb --rig facert-demo/character.h5
    """
    from facert.cli.shared.conversion import KINDS, Wanted, convert_file
    from facert.data.changes import Changes
    from facert.data.limits import parse_limits
    from facert.io.formats import targets_for
    from facert.io.poses import read_poses
    from facert.io.toml import read_drivers, read_toml

    others = (map_path, poses_path, rig_path, drivers_path)
    require_inputs(*others)
    todo = plan(paths, out_dir, ending, jobs, overwrite, KINDS, others)
    of_poses, of_take = targets_for(target, poses_path, paths[0])
    changes = Changes(
        names=read_toml(map_path) if map_path else {},
        poses=read_poses(poses_path, in_fps, keep or (), of_poses) if poses_path else None,
        limits=parse_limits(limits or ()),
        fps=fps,
        in_units=in_units,
        units=units,
        in_up_axis=in_up_axis,
        up_axis=up_axis,
        start_timecode=start_timecode,
    )
    drivers = read_drivers(drivers_path) if drivers_path else None
    wanted = Wanted(
        *(kind, of_take, shapes, in_fps, fps, rig_path, drivers), tuple(keep or ()), align_shapes
    )
    work = partial(convert_file, wanted=wanted, changes=changes, overwrite=overwrite)
    carry_out(todo, work, overwrite)
