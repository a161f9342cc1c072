"""``facert pose --view``: pose a character in the browser."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from facert.cli.shared import console
from facert.cli.shared.files import (
    actor_file,
    open_footage,
    read_actor,
    read_character,
    require_name,
)
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.interrupt import wait_for_end
from facert.cli.shared.options import DEFAULT_MODEL
from facert.data.text import for_shell, listed, plural
from facert.errors import reading

if TYPE_CHECKING:
    from facert.data.rig import Rig
    from facert.data.take import Take
    from facert.pages.session import PosingSession
    from facert.retarget.retargeter import Retargeter


@dataclass(frozen=True)
class Files:
    """Files and names given to ``facert pose``."""

    rig: Path | None
    drivers: Path | None
    takes: list[Path]
    model: Path | None
    actor: Path | None
    output: Path | None
    target: str | None
    shapes: str | None
    video: Path | None
    video_start: float | None


def open_page(files: Files, overwrite: bool, host: str, port: int) -> None:
    """Serve the page until Ctrl-C."""
    from facert.io.formats import read_take_file, targets_for
    from facert.pages.server import address, page_server, require_viser

    require_viser()
    from facert.pages.pose_page import PosePage

    if files.rig is None:
        raise typer.BadParameter("--view draws the character: give its rig with --rig")
    _require_one_take(files)
    require_inputs(files.rig, files.drivers, *files.takes, actor_file(files.actor), files.video)
    rig = read_character(files.rig, files.shapes, files.drivers)
    assert rig is not None  # as its file is given
    keys = targets_for(files.target, *files.takes)
    takes = [read_take_file(path, key) for path, key in zip(files.takes, keys, strict=True)]
    session = _session(files, rig, takes, overwrite)
    actors = [read_actor(take, files.actor, files.shapes) for take in takes]
    video = open_footage(files.video, takes[0], files.video_start) if takes else None
    title = ", ".join(path.name for path in files.takes or [files.rig])
    with page_server(title, host, port) as server:
        with reading(files.rig):
            page = PosePage(server, rig, session, actors, video)
        wait_for_end(address(server))
        page.stop()
    _show_end(session, page.unsaved_names)


def _require_one_take(files: Files) -> None:
    """Refuse what is there once where there are several takes, or none."""
    given = {"--output": files.output, "--video": files.video, "--video-start": files.video_start}
    alone = [name for name, value in given.items() if value is not None]
    if len(files.takes) > 1 and alone:
        raise typer.BadParameter(f"{alone[0]} is for one --take: each is saved beside itself")
    if not files.takes and files.video:
        raise typer.BadParameter("--video is by the time of a take: give it with --take")


def _session(files: Files, rig: Rig, takes: list[Take], overwrite: bool) -> PosingSession:
    """The recordings with their model, and where their labels go."""
    from facert.io.take import with_recording
    from facert.pages.session import PosingSession, character_controls, output_beside

    beside = [output_beside(path, one) for path, one in zip(files.takes, takes, strict=True)]
    outputs = beside if files.output is None else [files.output]
    for output in outputs:
        _require_output(output, overwrite)
    if len(set(outputs)) < len(outputs):
        raise typer.BadParameter("two takes would be saved to one file: rename one of them")
    model = _model(files)
    names = [path.name for path in files.takes]
    pairs = zip(takes, files.takes, strict=True)
    recorded = [with_recording(take, path).source for take, path in pairs]
    with reading(", ".join(map(str, files.takes)) or files.rig or ""):
        posed = next((one for one in takes if one.controls is not None), None)
        controls = character_controls(model, posed, rig)
        return PosingSession(controls, takes, model, outputs[: len(takes)], names, recorded)


def _show_end(session: PosingSession, unsaved: list[str]) -> None:
    """Show what was saved, and what was not."""
    for index, part in enumerate(session.parts):
        count = session.saved_of(index)
        if count:
            console.show(f"{part.output}: {plural(count, 'pose')} saved")
    if unsaved:
        console.log.warning("changed and not saved: %s", listed(unsaved))


def _require_output(output: Path, overwrite: bool) -> None:
    """Refuse a name that could not be written to once an hour of posing is done."""
    from facert.io.registry import OWN_ENDINGS, is_foreign, require_replaceable

    require_name(output, True, OWN_ENDINGS)
    for path in (output, output.with_suffix(".safetensors")):
        if path.exists() and not overwrite and not is_foreign(path):
            console.log.info(
                "to go on from its poses: --take %s --overwrite", for_shell(str(output))
            )
        require_replaceable(path, overwrite)


def _model(files: Files) -> Retargeter | None:
    """The model that was named, never one found by chance: it may be of another character."""
    import facert

    if files.model is None and DEFAULT_MODEL.exists():
        console.log.info("to go on with %s: --model %s", DEFAULT_MODEL, DEFAULT_MODEL)
    return None if files.model is None else facert.load(files.model)
