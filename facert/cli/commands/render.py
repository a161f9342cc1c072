"""``facert render``: a sheet of pictures, or a clip, of faces side by side."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.files import (
    PICTURES,
    actor_file,
    open_footage,
    read_actor,
    read_character,
    require_name,
    save_picture,
)
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    ACTOR,
    DRIVERS,
    OVERWRITE,
    RIG,
    SHAPES,
    TARGET,
    VIDEO,
    VIDEO_START,
    argument,
    file_option,
    option,
)
from facert.data.text import plural

if TYPE_CHECKING:
    from facert.data.rig import Rig
    from facert.data.take import Take
    from facert.render.faces import Face, FrameAt

FACES = 6
CLIP_RATES = {".mp4": 30.0, ".gif": 20.0}
MOST = 6


def command(
    path: Annotated[Path, argument("FILE", "A take, or a mesh sequence.")],
    output: Annotated[Path, argument("OUT", "A sheet (.png, .pdf, .svg) or a clip (.mp4, .gif).")],
    rig_path: RIG = None,
    drivers_path: DRIVERS = None,
    truth_path: Annotated[
        Path | None, file_option("The true poses, or the true mesh sequence.", "--truth")
    ] = None,
    beside: Annotated[
        list[Path] | None,
        file_option("Another face of the same frames; again for more.", metavar="FILE"),
    ] = None,
    frames: Annotated[
        str, option("For instance 0,30,60 for a sheet; 100..400 for a part of the take.")
    ] = "",
    size: Annotated[int, option("Pixels of a face a side.", min=64, max=2048)] = 320,
    fps: Annotated[
        float | None, option("Of a clip; by default 30, GIF 20.", min=1, max=120)
    ] = None,
    actor_path: ACTOR = None,
    video_path: VIDEO = None,
    video_start: VIDEO_START = None,
    target: TARGET = None,
    shapes: SHAPES = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Draw faces: a take with its rig or a mesh sequence, beside the truth and others.

    A sheet shows some frames, by default such as differ well; a clip shows the motion. Weights that
    a phone tracked are shown on a face of facert's own, also before there are poses.

    facert render retargeted.h5 faces.png --rig facert-demo/character.h5
    facert render retargeted.h5 face.gif --rig facert-demo/character.h5 --size 96
    """
    from facert.errors import reading
    from facert.io.formats import targets_for
    from facert.render.faces import require_extents, require_same_length

    require_inputs(path, rig_path, drivers_path, truth_path)
    require_inputs(actor_file(actor_path), video_path, *(beside or []))
    require_name(output, overwrite, (*PICTURES, *CLIP_RATES))
    wanted, others = _parse(frames), [(one, one.stem) for one in beside or []]
    others += [(truth_path, "truth")] if truth_path else []
    if len(others) >= MOST:
        raise typer.BadParameter(f"at most {MOST} faces fit on a picture")
    rig = read_character(rig_path, shapes, drivers_path)
    ours, *theirs = targets_for(target, path, *(one for one, _ in others))
    with ExitStack() as stack, reading(path):
        faces, take = _own_faces(stack, path, rig, ours, (actor_path, shapes))
        beside_it = zip(others, theirs, strict=True)
        faces += [_open_face(stack, one, rig, t, label)[0] for (one, label), t in beside_it]
        require_same_length(faces)
        require_extents(faces)
        footage = open_footage(video_path, faces[0].motion, video_start, size)
        video = None if footage is None else footage.at
        if output.suffix.lower() not in CLIP_RATES:
            content = _sheet(faces, take, wanted, (size, video), output, overwrite)
        else:
            content = _clip(faces, wanted, (size, video), fps, output, overwrite)
    console.show(f"{output}: {content}")


def _own_faces(
    stack: ExitStack,
    path: Path,
    rig: Rig | None,
    target: str | None,
    actor: tuple[Path | None, str | None],
) -> tuple[list[Face], Take | None]:
    """The faces of the file that is drawn: its actor's, and its character's; and the take."""
    from facert.io.formats import read_take_file
    from facert.io.mesh_sequence import holds_mesh_sequence

    if holds_mesh_sequence(path):
        return [_open_face(stack, path, rig, target)[0]], None
    take = read_take_file(path, target)
    seen = read_actor(take, *actor)
    if seen is not None and rig is None and not len(take.labels):
        return [seen], take
    face = _posed(take, rig, "character")
    return [face] if seen is None else [seen, face], take


def _posed(take: Take, rig: Rig | None, label: str) -> Face:
    from facert.errors import InputError
    from facert.render.faces import posed_face

    if rig is None:
        raise InputError("--rig", "the character's rig", "none", "Give it with --rig.")
    return posed_face(take, rig, label)


def _open_face(
    stack: ExitStack, path: Path, rig: Rig | None, target: str | None, label: str = ""
) -> tuple[Face, Take | None]:
    """A mesh sequence, or a rig in the poses of a take; and the take. The stack closes the file."""
    from facert.errors import reading
    from facert.io.formats import read_take_file
    from facert.io.mesh_sequence import holds_mesh_sequence, open_mesh_sequence
    from facert.render.faces import Face

    if holds_mesh_sequence(path):
        return Face(label or path.stem, stack.enter_context(open_mesh_sequence(path))), None
    take = read_take_file(path, target)
    with reading(path):
        return _posed(take, rig, label or "character"), take


def _sheet(
    faces: list[Face],
    take: Take | None,
    wanted: list[int] | range | None,
    cell: tuple[int, FrameAt | None],
    output: Path,
    overwrite: bool,
) -> str:
    """Draw some frames of every face; return which."""
    from facert.render.faces import choose_frames, outline, require_part, require_poses
    from facert.render.sheet import render_sheet

    if not isinstance(wanted, list):
        part = range(len(faces[0].motion)) if wanted is None else wanted
        require_part(part, len(faces[0].motion))
        posed = take is not None and len(take.labels)
        poses = require_poses(take) if take and posed else outline(faces[0].motion)
        chosen = choose_frames(poses[part.start : part.stop], FACES)
        wanted = [part.start + frame for frame in chosen]
    save_picture(render_sheet(faces, wanted, take, *cell), output, overwrite)
    return f"frames {', '.join(map(str, wanted))}"


def _clip(
    faces: list[Face],
    wanted: list[int] | range | None,
    cell: tuple[int, FrameAt | None],
    fps: float | None,
    output: Path,
    overwrite: bool,
) -> str:
    """Draw every face in motion; return how long."""
    from rich.progress import track

    from facert.io.video import write_clip
    from facert.render.clip import draw_clip, sampled_frames
    from facert.render.faces import require_part

    if isinstance(wanted, list):
        raise typer.BadParameter("a clip shows a part of the take: give it as in 100..400")
    motion = faces[0].motion
    part = range(len(motion)) if wanted is None else wanted
    require_part(part, len(motion))
    rate = fps or min(CLIP_RATES[output.suffix.lower()], motion.fps)
    chosen = sampled_frames(motion.time, part, rate)
    size, video = cell
    pictures = draw_clip(faces, chosen, size + size % 2, video)
    hidden = not console.err.is_terminal
    shown = track(
        pictures, "drawing", len(chosen), console=console.err, transient=True, disable=hidden
    )
    write_clip(iter(shown), output, rate, overwrite)
    return f"{plural(len(chosen), 'frame')}, {len(chosen) / rate:.1f} s at {rate:g} frames/s"


def _parse(frames: str) -> list[int] | range | None:
    """The numbers of a list such as ``0,30,60``, or the part ``100..400``; None if not given."""
    if not frames:
        return None
    try:
        if ".." in frames:
            first, last = map(int, frames.split(".."))
            return range(first, last + 1)
        return [int(frame) for frame in frames.split(",")]
    except ValueError:
        text = f"{frames!r}: give numbers as in 0,30,60, or a part as in 100..400"
        raise typer.BadParameter(text, param_hint="--frames") from None
