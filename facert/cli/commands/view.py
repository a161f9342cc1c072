"""``facert view``: a performance in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from facert.cli.shared.files import open_footage, read_actor, read_character
from facert.cli.shared.interrupt import wait_for_end
from facert.cli.shared.options import (
    ACTOR,
    DRIVERS,
    HOST,
    PORT,
    RIG,
    SHAPES,
    TARGET,
    TRUTH,
    VIDEO,
    VIDEO_START,
    argument,
    option,
)
from facert.errors import reading

if TYPE_CHECKING:
    from facert.data.rig import Rig
    from facert.data.take import Take
    from facert.pages.view_data import Performance
    from facert.retarget.retargeter import Retargeter


def command(
    path: Annotated[Path, argument("TAKE", "A take, or what retarget wrote.")],
    rig_path: RIG = None,
    drivers_path: DRIVERS = None,
    truth_path: TRUTH = None,
    model: Annotated[
        Path | None, option("Retarget TAKE with this model first.", "--model", "-m")
    ] = None,
    actor_path: ACTOR = None,
    video_path: VIDEO = None,
    video_start: VIDEO_START = None,
    target: TARGET = None,
    shapes: SHAPES = None,
    host: HOST = "127.0.0.1",
    port: PORT = 8080,
) -> None:
    """Show a performance in the browser: source, character and truth, with errors and curves.

    Ctrl-C ends it.

    facert view retargeted.h5 --rig facert-demo/character.h5
    facert view facert-demo/performance.h5 --model model.safetensors
    """
    import facert
    from facert.io.formats import read_source_file, read_take_file, targets_for
    from facert.pages.server import address, page_server, require_viser

    require_viser()
    from facert.pages.view_page import ViewPage

    ours, theirs = targets_for(target, path, truth_path)
    retargeter = facert.load(model) if model is not None else None
    if retargeter is None:
        take = read_take_file(path, ours)
    else:
        take = read_source_file(path, ours, retargeter.controls.names)
    rig = read_character(rig_path, shapes, drivers_path)
    truth = read_take_file(truth_path, theirs) if truth_path is not None else None
    with reading(path):
        performance = _performance(take, rig, truth, retargeter)
        actor = read_actor(take, actor_path, shapes)
    video = open_footage(video_path, take, video_start)
    with page_server(path.name, host, port) as server:
        page = ViewPage(server, performance, actor, video)
        wait_for_end(address(server))
        page.stop()


def _performance(
    take: Take, rig: Rig | None, truth: Take | None, retargeter: Retargeter | None
) -> Performance:
    """The take as it is, or retargeted."""
    from facert.pages.view_data import Performance, retargeted

    if retargeter is not None:
        return retargeted(take, retargeter, rig, truth)
    posed_here = take.labels if len(take.labels) < len(take) else take.labels[:0]
    return Performance(take, posed_here, rig, truth)
