"""``facert pose``: a whole pose from a few controls."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.files import save_json
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    ACTOR,
    DEFAULT_MODEL,
    DRIVERS,
    HOST,
    OVERWRITE,
    PORT,
    RIG,
    SEED,
    SHAPES,
    TARGET,
    VIDEO,
    VIDEO_START,
    file_option,
    option,
)
from facert.cli.shared.set_controls import parse_controls
from facert.data.version import CREATED_BY
from facert.errors import InputError, reading

if TYPE_CHECKING:
    from rich.table import Table

    from facert.data.take import Take
    from facert.posing.completed_pose import CompletedPose
    from facert.retarget.retargeter import Retargeter

SMALL = 0.005  # of a control's range: such values are not worth a line


def command(
    wanted: Annotated[
        list[str] | None, option("A control; again for more.", "--set", metavar="NAME=VALUE")
    ] = None,
    output: Annotated[
        Path | None,
        option(
            "A take (.h5, .csv, .livelink.csv), or .json; --view: TAKE.posed.h5.", "--output", "-o"
        ),
    ] = None,
    model: Annotated[
        Path | None,
        option("Model file that train wrote.", "--model", "-m", show_default=str(DEFAULT_MODEL)),
    ] = None,
    poses: Annotated[
        Path | None, file_option("A take with known poses, instead of a model's.")
    ] = None,
    start: Annotated[
        str,
        option(
            "Correct this retargeted frame: all its controls follow, but for those of --hold.",
            "--from",
            metavar="TAKE:FRAME",
        ),
    ] = "",
    hold: Annotated[
        list[str] | None,
        option(
            "With --from: controls that keep their value, as 'mouth*'; again for more.",
            metavar="PATTERN",
        ),
    ] = None,
    soft: Annotated[float, option("Standard deviation of the values; 0: exactly.", min=0.0)] = 0.0,
    samples: Annotated[int, option("Other plausible poses.", min=0, max=10_000)] = 0,
    seed: SEED = 0,
    target: TARGET = None,
    overwrite: OVERWRITE = False,
    view: Annotated[
        bool, option("Pose in the browser, with sliders; with --rig, --take, --actor.", "--view")
    ] = False,
    rig: RIG = None,
    drivers: DRIVERS = None,
    take: Annotated[
        list[Path] | None,
        option("The recording to pose, or a result to correct, for --view; again for more."),
    ] = None,
    actor: ACTOR = None,
    video: VIDEO = None,
    video_start: VIDEO_START = None,
    shapes: SHAPES = None,
    host: HOST = "127.0.0.1",
    port: PORT = 8080,
) -> None:
    """Find the most probable whole pose given a few controls; or pose with sliders (--view).

    facert pose --set jawOpen=0.4 -o posed.h5
    facert pose --view --rig facert-demo/character.h5
    """
    if view:
        from facert.cli.shared.pose_view import Files, open_page

        files = Files(
            rig, drivers, take or [], model, actor, output, target, shapes, video, video_start
        )
        return open_page(files, overwrite, host, port)
    if not wanted:
        raise typer.BadParameter("give values with --set NAME=VALUE, or --view for sliders")
    if hold and not start:
        raise typer.BadParameter("--hold keeps values of a frame: give it with --from TAKE:FRAME")
    model = model or DEFAULT_MODEL
    given = parse_controls(wanted)
    import facert
    from facert.io.registry import require_output

    require_inputs(poses)
    if output is not None:
        require_output(output, overwrite, "take")

    retargeter = facert.load(model) if start or poses is None else None
    begun = _retargeted(start, retargeter, target) if retargeter and start else None
    character = facert.read_take(poses, target) if poses else retargeter
    assert character is not None
    with reading(poses or model):
        done = facert.complete_pose(
            character, given, soft=soft, samples=samples, seed=seed, start=begun, hold=hold or ()
        )
    console.out.print(_table(done, soft))
    if output is not None:
        _write(done, output, overwrite, start)
        console.show(f"wrote {output}")


def _retargeted(start: str, retargeter: Retargeter, target: str | None) -> Take:
    """The frame of ``TAKE:FRAME``: as TAKE has it where that is a result, else retargeted."""
    from dataclasses import replace

    from facert.data.names import are_same
    from facert.io.formats import read_source_file

    path, _, number = start.rpartition(":")
    if not path or not number.isdecimal():
        raise typer.BadParameter(f"--from {start}: write it as in take.h5:120")
    take, frame = read_source_file(Path(path), target), int(number)
    if frame >= len(take):
        expected = f"a frame from 0 to {len(take) - 1}"
        raise InputError("--from", expected, number, "Choose another.", where=path)
    one = _frame(take, frame)
    known = () if take.controls is None else take.controls.names
    is_result = one.std is not None or take.corrections is not None
    if is_result and are_same(known, retargeter.controls.names):
        return one
    with reading(path):
        return retargeter.retarget(replace(one, params=None, std=None))


def _frame(take: Take, frame: int) -> Take:
    """One frame of a take; what has a standard deviation was retargeted already."""
    from dataclasses import replace

    from facert.data.corrections import taken_out

    source = replace(take.source, values=take.source.values[[frame]])
    params = None if take.params is None else take.params[[frame]]
    std = taken_out(take).std
    std = None if std is None or frame not in take.labels else std[[frame]]
    return replace(
        take,
        time=take.time[[frame]],
        source=source,
        params=params,
        std=std,
        animation=None,
        corrections=None,
    )


def _table(done: CompletedPose, soft: float) -> Table:
    """Table of controls: the given ones, then others by size; those at rest are counted below."""
    import numpy as np
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("control")
    for title in ("value", "±"):
        table.add_column(title, justify="right")
    table.add_column("")
    order = np.argsort(-np.abs(done.pose), kind="stable")
    names = [done.controls.names[index] for index in order]
    first = [index for index, name in zip(order, names, strict=True) if name in done.given]
    others = [index for index, name in zip(order, names, strict=True) if name not in done.given]
    least = SMALL * float(np.abs(done.pose).max())
    shown = [index for index in others if abs(done.pose[index]) >= least]
    for index in first + shown:
        name, value = done.controls.names[index], done.pose[index]
        spread = f"{done.std[index]:.3f}" if done.std[index] else ""
        style = "bold" if name in done.given else None
        mark = _mark(done, name, soft)
        table.add_row(console.cell(name), f"{value:.3f}", spread, mark, style=style)
    if len(others) > len(shown):
        table.caption = f"{len(others) - len(shown)} more at 0"
        table.caption_justify = "left"
    return table


def _mark(done: CompletedPose, name: str, soft: float) -> str:
    """Remark on where a control's value comes from, empty when the model completed it."""
    if name in done.given:
        return f"near {done.given[name]:g}" if soft else "given"
    return "held" if name in done.held else ""


def _write(done: CompletedPose, output: Path, overwrite: bool, start: str) -> None:
    """Write a take with a pose a frame, or JSON; of a corrected frame with its number and time."""
    from facert.io.formats import write_take_file

    if output.suffix.lower() == ".json":
        frame = {"frame": int(start.rpartition(":")[2])} if start else {}
        save_json({"created_by": CREATED_BY, **frame, **done.as_dict}, output, overwrite)
    else:
        write_take_file(done.as_take, output, overwrite)
