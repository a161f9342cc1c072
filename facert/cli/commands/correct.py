"""``facert correct``: puts corrected poses into a result, and keeps them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import DEFAULT_MODEL, OVERWRITE, argument, file_option, option
from facert.cli.shared.set_controls import parse_controls
from facert.data.text import for_shell, plural, printable
from facert.errors import InputError, reading
from facert.io.registry import OWN_ENDINGS, require_replaceable

if TYPE_CHECKING:
    from facert.data.arrays import FloatArray
    from facert.data.take import Take

    Corrected = Mapping[int, Mapping[str, float] | FloatArray]
    """For each frame the controls that are set, or a whole pose (P,)."""

ALL = "all"
NAMED, LINES = 3, 10  # controls that are named, and frames that have a line
SMALL = 0.005  # of the largest move: such a one is not worth a word


def command(
    path: Annotated[Path, argument("RESULT", "What retarget wrote (.h5).")],
    frames: Annotated[
        str, option("The frame to correct, from 0; several as 740..745 or 12,30.", "--frame")
    ] = "",
    wanted: Annotated[
        list[str] | None, option("A control; again for more.", "--set", metavar="NAME=VALUE")
    ] = None,
    confirm: Annotated[
        bool, option("The frames of --frame are right as they are: labels for train.", "--confirm")
    ] = False,
    poses: Annotated[
        Path | None,
        file_option("Poses instead, by a column frame or by time: of Blender, or a take."),
    ] = None,
    width: Annotated[
        float | None,
        option(
            "Seconds over which a correction is blended, half of them before the frame.",
            min=0.0,
            show_default="0.5",
        ),
    ] = None,
    hold: Annotated[
        list[str] | None,
        option("Controls that keep their value, as 'mouth*'; again for more.", metavar="PATTERN"),
    ] = None,
    only: Annotated[bool, option("Change the controls that are set, and no others.")] = False,
    follow: Annotated[
        bool,
        option("Others follow even where no known pose comes near: a guess.", "--follow"),
    ] = False,
    remove: Annotated[
        str, option("Take the corrections of these frames back, or all.", metavar="FRAMES|all")
    ] = "",
    show: Annotated[bool, option("List the corrections in RESULT.", "--list")] = False,
    model: Annotated[
        Path | None,
        option(
            "Model whose poses show what the other controls then do.",
            "--model",
            "-m",
            show_default=f"the one that RESULT names, or {DEFAULT_MODEL}",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        option("Corrected result (.h5); else RESULT itself, with --overwrite.", "--output", "-o"),
    ] = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Correct poses of a result; they are blended over time, kept, and learned from.

    What is set is met exactly, and the other controls of the frame follow as in facert pose --from.
    retarget puts the corrections in again, and train learns from them.

    facert correct retargeted.h5 --frame 40 --set smile=0.6 --overwrite
    facert correct retargeted.h5 --list
    """
    _require_one(frames, bool(wanted) + confirm, poses, remove, show)
    if (hold or only) and not (wanted or poses):
        raise typer.BadParameter("--hold and --only are for --set and --poses")
    require_inputs(path, poses)
    take = _read(path)
    if show:
        return _list(take)
    from facert.posing.corrected_take import require_result

    output = output or path
    _require_output(output, overwrite)
    with reading(path):
        if remove:
            made = _without(take, remove)
        else:
            require_result(take)
            if poses is not None:
                corrected = _of_file(take, poses)
            else:
                corrected = _of_options(take, frames, parse_controls(wanted or []))
            known = model or _named_model(take, path)
            made = _corrected(take, corrected, width, hold or [], (only, follow), known)
    _write(take, made, path, output)


def _require_one(frames: str, ways: int, poses: Path | None, remove: str, show: bool) -> None:
    """Refuse nothing at all, two things at once, and a frame without what becomes of it."""
    if sum(map(bool, (frames or ways, poses, remove, show))) != 1:
        text = "give --frame with --set NAME=VALUE, or one of --poses, --remove and --list"
        raise typer.BadParameter(text)
    if bool(frames) != bool(ways):
        raise typer.BadParameter("give both --frame and --set NAME=VALUE (or --confirm)")
    if ways > 1:
        raise typer.BadParameter("--confirm leaves a frame as it is: give it without --set")


def _read(path: Path) -> Take:
    """Read the result; other formats than facert's own hold no corrections."""
    from facert.io.formats import read_take_file

    if path.suffix.lower() not in OWN_ENDINGS:
        fix = (
            f"Retarget to .h5 and correct that; facert convert RESULT.h5 {path.name} "
            "then writes it for other programs."
        )
        found = path.suffix or "none"
        raise InputError("RESULT's ending", " or ".join(OWN_ENDINGS), found, fix, str(path))
    return read_take_file(path)


def _require_output(output: Path, overwrite: bool) -> None:
    if output.suffix.lower() not in OWN_ENDINGS:
        found, fix = output.suffix or "none", "Convert the corrected result afterwards."
        raise InputError("--output", " or ".join(OWN_ENDINGS), found, fix)
    require_replaceable(output, overwrite)


def _corrected(
    take: Take,
    poses: Corrected,
    width: float | None,
    hold: list[str],
    others: tuple[bool, bool],
    model: Path,
) -> Take:
    """The take with poses corrected; with a model where some of their controls are to follow.

    `others` states whether the others stay, and whether they follow wherever it leads.
    """
    import facert
    from facert.data.corrections import WIDTH

    only, follow = others
    whole = not any(isinstance(pose, Mapping) for pose in poses.values())
    character = None if only or whole else facert.load(model)
    width = WIDTH if width is None else width
    return facert.correct(take, poses, character, width=width, hold=hold, only=only, follow=follow)


def _named_model(take: Take, path: Path) -> Path:
    """The model that the result names, beside it or in the working folder; else the default."""
    name = Path(take.model.partition(": ")[0]).name
    if not name.endswith(DEFAULT_MODEL.suffix):
        return DEFAULT_MODEL
    for place in (path.parent / name, Path(name)):
        if place.is_file():
            console.log.info("model: %s, which %s names; --model takes another", place, path.name)
            return place
    return DEFAULT_MODEL


def _of_options(take: Take, frames: str, given: Mapping[str, float]) -> Corrected:
    """Controls that are set in some frames; without any, their poses as they are."""
    from facert.data.ranges import parse_frames

    asked = parse_frames(frames, "--frame")
    assert take.params is not None  # it is a result
    if given or asked[-1] >= len(take):  # correcting says what is wrong
        return dict.fromkeys(asked, given)
    return {frame: take.params[frame] for frame in asked}


def _of_file(take: Take, path: Path) -> Corrected:
    """Poses of a table or another take: whole ones, or those of the controls that a row has."""
    from dataclasses import replace

    import numpy as np

    from facert.data.labelling import placed
    from facert.data.names import match
    from facert.data.take import Controls
    from facert.io.poses import read_poses

    poses = read_poses(path)
    assert take.controls is not None  # it is a result
    assert take.params is not None
    with reading(path):
        columns = match(poses.names, take.controls.names, "names of the poses")
    names = tuple(take.controls.names[column] for column in columns)
    params = take.params[:, columns]
    part = replace(take, controls=Controls(names), params=params, std=None, corrections=None)
    frames, _, values = placed(replace(part, animation=None), poses)
    if len(names) < len(take.controls.names) or np.isnan(values).any():
        cells = (zip(names, row.tolist(), strict=True) for row in values)
        rows = ({name: value for name, value in row if not math.isnan(value)} for row in cells)
        return dict(zip(frames.tolist(), rows, strict=True))
    ordered = values[:, match(take.controls.names, names, "names of the poses")]
    return dict(zip(frames.tolist(), ordered, strict=True))


def _without(take: Take, remove: str) -> Take:
    """The take with corrections taken back."""
    import numpy as np

    from facert.data.corrections import put_in, taken_out, without
    from facert.data.ranges import parse_frames

    if take.corrections is None:
        found, fix = "none in it", "facert correct --list shows what there is."
        raise InputError("--remove", "a result with corrections", found, fix)
    if remove == ALL:
        return taken_out(take)
    frames = np.array(parse_frames(remove, "--remove"), dtype=np.int64)
    left = without(take.corrections, frames)
    return taken_out(take) if left is None else put_in(take, left)


def _write(take: Take, made: Take, path: Path, output: Path) -> None:
    """Write the result, and a line on each frame that has another pose now."""
    from facert.io.take import beside_recording, with_recording, write_take

    recorded = with_recording(take, path).source
    beside = {} if recorded is take.source else beside_recording(recorded)
    write_take(made, output, overwrite=True, beside=beside)
    frames = _changed(take, made)
    for frame in frames[:LINES]:
        console.show(f"frame {frame} ({take.time[frame]:.3f} s): {_moves(take, made, frame)}")
    if len(frames) > LINES:
        console.show(f"and {plural(len(frames) - LINES, 'more frame')}")
    console.show(f"wrote {output}")
    count = 0 if made.corrections is None else len(made.corrections.frames)
    if count:
        text = "%s holds %s: facert train TAKE %s learns from what was corrected"
        console.log.info(text, output.name, plural(count, "correction"), for_shell(output.name))


def _changed(take: Take, made: Take) -> list[int]:
    """Frames that were corrected, or were before, and have another pose now."""
    both = (one.corrections.frames for one in (take, made) if one.corrections is not None)
    frames = sorted({frame for frames in both for frame in frames.tolist()})
    assert take.params is not None  # it is a result
    assert made.params is not None
    return [f for f in frames if (take.params[f] != made.params[f]).any()]


def _moves(before: Take, after: Take, frame: int) -> str:
    """The controls that moved most from one pose to another, and how many others moved."""
    import numpy as np

    assert before.params is not None  # both are results of the same controls
    assert after.params is not None
    assert before.controls is not None
    old, new = before.params[frame], after.params[frame]
    sizes = np.abs(new - old)
    first = np.argsort(-sizes, kind="stable")[:NAMED]
    shown = [index for index in first.tolist() if sizes[index] > 0]
    names = before.controls.names
    moves = [f"{printable(names[index])} {old[index]:.3f} to {new[index]:.3f}" for index in shown]
    others = int((sizes > SMALL * sizes.max()).sum()) - len(shown)
    if not moves:
        return "right as predicted"
    return ", ".join(moves) + (f" and {plural(others, 'other')}" if others > 0 else "")


def _list(take: Take) -> None:
    """Print the corrections, a row each."""
    from rich import box
    from rich.table import Table

    from facert.data.corrections import taken_out
    from facert.data.timecode import timecode

    if take.corrections is None:
        console.show("no corrections")
        return
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("frame", "seconds", "timecode", "width"):
        table.add_column(title, justify="right")
    table.add_column("moved most")
    bare = taken_out(take)
    for frame, width in zip(take.corrections.frames, take.corrections.width, strict=True):
        seconds = float(take.time[frame])
        code = timecode(take.start_timecode, seconds, take.fps)
        row = (f"{frame}", f"{seconds:.3f}", code, f"{width:g}")
        table.add_row(*row, console.cell(_moves(bare, take, int(frame))))
    console.out.print(table)
