"""``facert points``: feature points of a face."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facert.cli import console
from facert.cli.options import OVERWRITE, SHAPES
from facert.wording import plural

app = typer.Typer(help="Feature points of a face.", no_args_is_help=True)


@app.callback()
def points() -> None:
    """Feature points that drive a face."""


@app.command("suggest")
def suggest(
    rig_path: Annotated[
        Path, typer.Argument(metavar="RIG", help="A rig file, .npz or folder of .obj.")
    ],
    count: Annotated[int, typer.Option("-n", min=1, help="How many points.")] = 80,
    picture: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Draw them on the face.")
    ] = None,
    shapes: SHAPES = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Print the vertices that serve driving best, the most useful first.

    With commas between them, as `facert simulate --vertices` takes them.
    """
    from facert.cli.pictures import require_picture_name, save_picture
    from facert.errors import reading
    from facert.io.formats import read_rig_file
    from facert.topology.suggestion import suggest_points
    from facert.view.points import draw_points

    if picture is not None:
        require_picture_name(picture, overwrite)
    rig = read_rig_file(rig_path, shapes)
    with reading(rig_path):
        chosen = suggest_points(rig, count)
    if picture is not None:
        save_picture(draw_points(rig.mesh, chosen), picture, overwrite)
        console.log.info("%s: %s on the face", picture, plural(len(chosen), "point"))
    console.out.print(",".join(map(str, chosen)), markup=False)
