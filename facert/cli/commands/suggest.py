"""``facert suggest``: the frames of a take that are most worth posing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.files import (
    actor_file,
    open_footage,
    read_actor,
    require_name,
    save_picture,
)
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    AS_JSON,
    OVERWRITE,
    SEED,
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
    from facert.data.arrays import IntArray
    from facert.data.take import Take
    from facert.posing.suggested_frames import Suggestion
    from facert.retarget.retargeter import Retargeter

LABELS = "labels"


def command(
    take_path: Annotated[Path, argument("TAKE", "What was recorded.")],
    count: Annotated[int, option("How many frames.", "-n", min=1, max=1000)] = 10,
    have: Annotated[
        str,
        option(
            "Go on from the take's posed frames, or from a model that is trained already.",
            metavar="labels|MODEL",
        ),
    ] = "",
    seed: SEED = 0,
    sheet: Annotated[
        Path | None, file_option("A contact sheet of the frames.", metavar="PNG")
    ] = None,
    actor_path: Annotated[
        Path | None,
        file_option(
            "The actor's rig, to draw tracked weights; none: no face.",
            "--rig",
            "--actor",
            show_default="facert's own, for ARKit's shapes",
        ),
    ] = None,
    video_path: VIDEO = None,
    video_start: VIDEO_START = None,
    target: TARGET = None,
    shapes: SHAPES = None,
    as_json: AS_JSON = False,
    overwrite: OVERWRITE = False,
) -> None:
    """Print the frames whose posing would help most, the most useful first.

    Without --have poses are not looked at. Frames are numbered from 0.

    facert suggest facert-demo/training.h5 -n 12 --sheet suggested.png
    facert suggest facert-demo/training.h5 --have labels
    """
    import json

    from facert.data.moments import frame_label
    from facert.errors import reading
    from facert.posing.suggested_frames import suggest_frames
    from facert.render.faces import require_drawable
    from facert.render.sheet import MAX_FRAMES, contact_sheet

    if sheet is None and (actor_path or video_path):
        option = "--rig" if actor_path else "--video"
        raise typer.BadParameter(f"{option} is for the sheet: give --sheet as well")
    require_inputs(take_path, actor_file(actor_path), video_path)
    if sheet is not None:
        require_name(sheet, overwrite)
        if count > MAX_FRAMES:
            raise typer.BadParameter(f"a sheet shows at most {MAX_FRAMES} frames")
    model = _model(have) if have not in ("", LABELS) else None
    take = _read(take_path, target, have, model)
    with reading(take_path):
        actor = read_actor(take, actor_path, shapes) if sheet else None
        footage = open_footage(video_path, take, video_start)
        if sheet is not None and footage is None:
            require_drawable(take, actor)
        found = suggest_frames(take, count, model or _posed(take, have), seed)
    rows = _rows(take, found)
    if as_json:
        typer.echo(json.dumps({"file": str(take_path), "frames": rows}, indent=2))
    else:
        _print(take, found.frames.tolist(), rows)
    if sheet is not None:
        frames, video = found.frames.tolist(), None if footage is None else footage.at
        with reading(take_path):
            headings = [frame_label(take, frame) for frame in frames]
            figure = contact_sheet(take, frames, headings, actor, video)
        save_picture(figure, sheet, overwrite)
        console.log.info("%s: %s", sheet, plural(len(rows), "frame"))


def _read(path: Path, target: str | None, have: str, model: Retargeter | None) -> Take:
    """Read the take; of several targets the one that the suggestion continues, else none."""
    from facert.io.formats import read_source_file, read_take_file

    if have == LABELS:
        return read_take_file(path, target)
    return read_source_file(path, target, () if model is None else model.controls.names)


def _posed(take: Take, have: str) -> Sequence[int] | IntArray:
    """Posed frames that the suggestion continues."""
    if have != LABELS:
        return ()
    if not len(take.labels):
        from facert.errors import InputError

        raise InputError(
            "/target/params", "posed frames, for --have labels", "none", "Leave --have out."
        )
    console.log.info("goes on from %s", plural(len(take.labels), "posed frame"))
    return take.labels


def _model(path: str) -> Retargeter:
    from facert.retarget.retargeter import load

    if not path.endswith(".safetensors"):
        raise typer.BadParameter("--have takes the word labels, or a model (.safetensors)")
    return load(path)


def _rows(take: Take, found: Suggestion) -> list[dict[str, object]]:
    """A line for each frame; without a timecode where the take has none."""
    from facert.data.moments import timecode_of

    rows: list[dict[str, object]] = []
    for frame, share in zip(found.frames.tolist(), found.shares.tolist(), strict=True):
        row: dict[str, object] = {"frame": frame, "seconds": float(take.time[frame])}
        code = timecode_of(take, frame)
        rows.append(row | ({"timecode": code} if code else {}) | {"share": share})
    return rows


def _print(take: Take, frames: Sequence[int], rows: Sequence[dict[str, object]]) -> None:
    from rich import box
    from rich.table import Table

    from facert.data.moments import moment

    table = Table(box=box.SIMPLE)
    for name in ("frame", "timecode" if "timecode" in rows[0] else "time", "stands for"):
        table.add_column(name, justify="right")
    for frame, row in zip(frames, rows, strict=True):
        table.add_row(str(frame), moment(take, frame), f"{row['share']:.1%}")
    console.out.print(table)
    console.show("stands for: the share of the take's frames that are nearest to it")
    console.show(f"in order of time: {','.join(map(str, sorted(frames)))}")
