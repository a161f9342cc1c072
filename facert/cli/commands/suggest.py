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
from facert.cli.shared.takes import listed_files, short_names
from facert.data.text import for_json, plural

if TYPE_CHECKING:
    from facert.data.arrays import IntArray
    from facert.data.take import Take
    from facert.data.takes import Takes
    from facert.posing.suggested_frames import Suggestion
    from facert.retarget.retargeter import Retargeter

LABELS = "labels"
HEADING = 28
"""Characters above a picture of the sheet, at most."""


def command(
    paths: Annotated[list[Path], argument("TAKE...", "What was recorded of an actor.")],
    count: Annotated[int, option("How many frames.", "-n", min=1, max=1000)] = 10,
    have: Annotated[
        str,
        option(
            "Go on from the takes' posed frames, or from a model that is trained already.",
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

    Without --have poses are not looked at. Frames are numbered from 0; those of several takes are
    written FILE:FRAME.

    facert suggest facert-demo/training.h5 -n 12 --sheet suggested.png
    facert suggest facert-demo/training.h5 --have labels
    """
    from facert.data.matching_takes import as_takes, without_poses
    from facert.errors import reading
    from facert.posing.suggested_frames import suggest_frames
    from facert.render.faces import require_drawable
    from facert.render.sheet import MAX_FRAMES, contact_sheet

    if sheet is None and (actor_path or video_path):
        option = "--rig" if actor_path else "--video"
        raise typer.BadParameter(f"{option} is for the sheet: give --sheet as well")
    if video_path is not None and len(paths) > 1:
        raise typer.BadParameter("--video is of one take: name the frames of each for itself")
    require_inputs(*paths, actor_file(actor_path), video_path)
    if sheet is not None:
        require_name(sheet, overwrite)
        if count > MAX_FRAMES:
            raise typer.BadParameter(f"a sheet shows at most {MAX_FRAMES} frames")
    model = _model(have) if have not in ("", LABELS) else None
    given = _read(paths, target, have, model)
    with reading(listed_files(paths)):
        posed = _posed(given, short_names(paths)) if have == LABELS else ()
        recorded = given if model else list(map(without_poses, given))
        takes = as_takes(recorded, (), short_names(paths))
        actor = read_actor(takes.joined, actor_path, shapes) if sheet else None
        footage = open_footage(video_path, given[0], video_start)
        if sheet is not None and footage is None:
            require_drawable(takes.joined, actor)
        with console.without_judged():  # what is unlike the posed frames is what this names
            found = suggest_frames(takes, count, model or posed, seed)
    rows = _rows(takes, found)
    if as_json:
        files = {"file": str(paths[0])} if len(paths) == 1 else {"files": list(map(str, paths))}
        console.write(for_json(files | {"frames": rows}) + "\n")
    else:
        _print(takes, found, rows)
    if sheet is not None:
        frames = (takes.starts[found.takes] + found.frames).tolist()
        with reading(listed_files(paths)):
            video = None if footage is None else footage.at
            headings = _headings(takes, found)
            figure = contact_sheet(takes.joined, frames, headings, actor, video)
        save_picture(figure, sheet, overwrite)
        console.log.info("%s: %s", sheet, plural(len(rows), "frame"))


def _read(
    paths: Sequence[Path], target: str | None, have: str, model: Retargeter | None
) -> list[Take]:
    """Read takes; of several targets the one that the suggestion continues, else none."""
    from facert.io.formats import read_source_file, read_take_file, targets_for

    names = () if model is None else model.controls.names
    keys = zip(paths, targets_for(target, *paths), strict=True)
    if have == LABELS:
        return [read_take_file(path, key) for path, key in keys]
    return [read_source_file(path, key, names) for path, key in keys]


def _posed(takes: Sequence[Take], names: Sequence[str]) -> list[IntArray] | IntArray:
    """Posed frames of each take that the suggestion continues."""
    from facert.data.labelling import without_predicted
    from facert.data.subject import about
    from facert.preprocess.label_checks import warn_of_labels

    posed = list(map(without_predicted, takes))
    labels = [take.labels for take in posed]
    count = sum(map(len, labels))
    if not count:
        from facert.errors import InputError

        raise InputError(
            "/target/params", "posed frames, for --have labels", "none", "Leave --have out."
        )
    for take, name in zip(posed, names if len(posed) > 1 else ("",), strict=True):
        with about(name):
            warn_of_labels(take)
    console.log.info("goes on from %s", plural(count, "posed frame"))
    return labels if len(labels) > 1 else labels[0]


def _model(path: str) -> Retargeter:
    from facert.retarget.retargeter import load

    if not path.endswith(".safetensors"):
        raise typer.BadParameter("--have takes the word labels, or a model (.safetensors)")
    return load(path)


def _rows(takes: Takes, found: Suggestion) -> list[dict[str, object]]:
    """A line for each frame; without a timecode where a take has none, or a file with one take."""
    from facert.data.moments import timecode_of

    rows: list[dict[str, object]] = []
    places = zip(found.takes.tolist(), found.frames.tolist(), found.shares.tolist(), strict=True)
    for place, frame, share in places:
        take, name = takes.named[place]
        row: dict[str, object] = {"frame": frame, "seconds": float(take.time[frame])}
        row |= {"file": name, "name": f"{name}:{frame}"} if name else {}
        code = timecode_of(take, frame)
        rows.append(row | ({"timecode": code} if code else {}) | {"share": share})
    return rows


def _headings(takes: Takes, found: Suggestion) -> list[str]:
    """Each frame and when it was, as far as there is room above a picture."""
    from facert.data.moments import frame_label

    headings = []
    for place, frame in zip(found.takes.tolist(), found.frames.tolist(), strict=True):
        take, name = takes.named[place]
        label = f"{name}:{frame_label(take, frame)}" if name else frame_label(take, frame)
        number = f"{name}:{frame}"
        shown = label if not name or len(label) <= HEADING else number
        headings.append(shown if len(shown) <= HEADING else f"...{shown[3 - HEADING :]}")
    return headings


def _print(takes: Takes, found: Suggestion, rows: Sequence[dict[str, object]]) -> None:
    from rich import box
    from rich.table import Table

    from facert.data.moments import moment

    table = Table(box=box.SIMPLE)
    coded = all("timecode" in row for row in rows)
    for name in ("frame", "timecode" if coded else "time", "stands for"):
        table.add_column(name, justify="right")
    for place, row in zip(found.takes.tolist(), rows, strict=True):
        frame = int(str(row["frame"]))
        shown = console.cell(str(row.get("name", frame)))
        table.add_row(shown, moment(takes.parts[place], frame), f"{row['share']:.1%}")
    console.out.print(table)
    whose = "the take's" if len(takes.parts) == 1 else "all takes'"
    console.show(f"stands for: the share of {whose} frames that are nearest to it")
    for place, (_, name) in enumerate(takes.named):
        own = sorted(found.frames[found.takes == place].tolist())
        if own:
            where = f", {name}" if name else ""
            console.show(f"in order of time{where}: {','.join(map(str, own))}")
