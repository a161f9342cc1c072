"""``facert suggest``: the frames of a take that are most worth posing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.files import require_name, save_picture
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    AS_JSON,
    OVERWRITE,
    SEED,
    SHAPES,
    TARGET,
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
    rig_path: Annotated[
        Path | None, file_option("The actor's rig, to draw tracked weights.", "--rig")
    ] = None,
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

    from facert.errors import reading
    from facert.io.formats import read_rig_file
    from facert.posing.suggested_frames import suggest_frames
    from facert.render.faces import require_drawable
    from facert.render.sheet import MAX_FRAMES, contact_sheet

    if rig_path is not None and sheet is None:
        raise typer.BadParameter("--rig is for the sheet: give --sheet as well")
    require_inputs(take_path, rig_path)
    if sheet is not None:
        require_name(sheet, overwrite)
        if count > MAX_FRAMES:
            raise typer.BadParameter(f"a sheet shows at most {MAX_FRAMES} frames")
    rig = read_rig_file(rig_path, shapes) if rig_path is not None else None
    model = _model(have) if have not in ("", LABELS) else None
    take = _read(take_path, target, have, model)
    with reading(take_path):
        if sheet is not None:
            require_drawable(take, rig)
        found = suggest_frames(take, count, model or _posed(take, have), seed)
    rows = _rows(take, found)
    if as_json:
        typer.echo(json.dumps({"file": str(take_path), "frames": rows}, indent=2))
    else:
        _print(rows)
    if sheet is not None:
        with reading(take_path):
            headings = [f"{row['frame']}   {_moment(row)}" for row in rows]
            figure = contact_sheet(take, found.frames.tolist(), headings, rig)
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
    from facert.data.timecode import timecode

    rows: list[dict[str, object]] = []
    for frame, share in zip(found.frames.tolist(), found.shares.tolist(), strict=True):
        seconds = float(take.time[frame])
        code = timecode(take.start_timecode, seconds, take.fps)
        row: dict[str, object] = {"frame": frame, "seconds": seconds}
        rows.append(row | ({"timecode": code} if code else {}) | {"share": share})
    return rows


def _moment(row: dict[str, object]) -> str:
    return str(row.get("timecode") or f"{row['seconds']:.2f} s")


def _print(rows: Sequence[dict[str, object]]) -> None:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE)
    for name in ("frame", "timecode" if "timecode" in rows[0] else "time", "stands for"):
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(str(row["frame"]), _moment(row), f"{row['share']:.1%}")
    console.out.print(table)
    console.show("stands for: the share of the take's frames that are nearest to it")
    in_time = sorted((str(row["frame"]) for row in rows), key=int)
    console.show(f"in order of time: {','.join(in_time)}")
