"""``facert render``: a picture of the character's face."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facert.cli import console

FACES = 6


def command(
    take_path: Annotated[Path, typer.Argument(metavar="TAKE", help="A take with poses.")],
    output: Annotated[Path, typer.Argument(metavar="OUT.png", help="The picture.")],
    rig_path: Annotated[Path, typer.Option("--rig", help="The character's rig.")],
    truth_path: Annotated[
        Path | None, typer.Option("--truth", help="A take with the true poses.")
    ] = None,
    frames: Annotated[
        str, typer.Option(help="For instance 0,30,60; by default some that differ well.")
    ] = "",
    target: Annotated[
        str | None, typer.Option(help="Which of several targets of .npz takes.")
    ] = None,
    shapes: Annotated[
        str | None, typer.Option(help="Which of several sets of shapes of an .npz rig.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the picture.")] = False,
) -> None:
    """Draw faces: markers, the character with the take's poses, and with the true ones."""
    from facert.cli.pictures import require_picture_name, save_picture
    from facert.errors import reading
    from facert.io.formats import read_rig_file, read_take_file
    from facert.view.render import choose_frames, render_faces, require_poses

    require_picture_name(output, overwrite)
    take, rig = read_take_file(take_path, target), read_rig_file(rig_path, shapes)
    truth = read_take_file(truth_path, target) if truth_path else None
    with reading(take_path):
        chosen = _parse(frames) if frames else choose_frames(require_poses(take), FACES)
        figure = render_faces(take, rig, chosen, truth)
    save_picture(figure, output, overwrite)
    console.out.print(f"{output}: frames {', '.join(map(str, chosen))}", markup=False)


def _parse(frames: str) -> list[int]:
    """The numbers of a list such as ``0,30,60``."""
    try:
        return [int(frame) for frame in frames.split(",")]
    except ValueError:
        raise typer.BadParameter("give frame numbers with commas, as in 0,30,60") from None
