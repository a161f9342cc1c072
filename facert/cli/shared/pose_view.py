"""``facert pose --view``: pose a character in the browser."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from facert.cli.shared import console
from facert.cli.shared.files import actor_file, read_actor, read_character, require_name
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.interrupt import wait_for_end
from facert.cli.shared.options import DEFAULT_MODEL
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
    take: Path | None
    model: Path | None
    actor: Path | None
    output: Path | None
    target: str | None
    shapes: str | None


def open_page(files: Files, overwrite: bool, host: str, port: int) -> None:
    """Serve the page until Ctrl-C."""
    from facert.io.formats import read_take_file
    from facert.pages.server import address, page_server, require_viser

    require_viser()
    from facert.pages.pose_page import PosePage

    if files.rig is None:
        raise typer.BadParameter("--view draws the character: give its rig with --rig")
    require_inputs(files.rig, files.drivers, files.take, actor_file(files.actor))
    rig = read_character(files.rig, files.shapes, files.drivers)
    assert rig is not None  # as its file is given
    take = None if files.take is None else read_take_file(files.take, files.target)
    session = _session(files, rig, take, overwrite)
    actor = None if take is None else read_actor(take, files.actor, files.shapes)
    title = files.rig.name if files.take is None else files.take.name
    with page_server(title, host, port) as server:
        with reading(files.rig):
            page = PosePage(server, rig, session, actor)
        wait_for_end(address(server))
        page.stop()
    if session.saved:
        console.show(f"{session.output}: {session.saved} poses saved")


def _session(files: Files, rig: Rig, take: Take | None, overwrite: bool) -> PosingSession:
    """The recording with its model, and where its labels go."""
    from facert.pages.session import PosingSession, character_controls, output_beside

    output = files.output
    if output is None and files.take is not None:
        output = output_beside(files.take)
    model = _model(files)
    if output is not None:
        _require_output(output, overwrite)
    with reading(files.take or files.rig or ""):
        return PosingSession(character_controls(model, take, rig), take, model, output)


def _require_output(output: Path, overwrite: bool) -> None:
    """Refuse names that could not be written to once an hour of posing is done."""
    from facert.io.registry import OWN_ENDINGS, is_foreign, require_replaceable

    require_name(output, True, OWN_ENDINGS)
    for path in (output, output.with_suffix(".safetensors")):
        if path.exists() and not overwrite and not is_foreign(path):
            console.log.info("to go on from its poses: --take %s --overwrite", output)
        require_replaceable(path, overwrite)


def _model(files: Files) -> Retargeter | None:
    """The model that was named, never one found by chance: it may be of another character."""
    import facert

    if files.model is None and DEFAULT_MODEL.exists():
        console.log.info("to go on with %s: --model %s", DEFAULT_MODEL, DEFAULT_MODEL)
    return None if files.model is None else facert.load(files.model)
