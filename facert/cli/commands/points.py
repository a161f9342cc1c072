"""``facert points``: feature points of a face."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.files import require_name, save_picture
from facert.cli.shared.help import Command, Group
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import OVERWRITE, SHAPES, argument, file_option, option
from facert.data.text import plural

if TYPE_CHECKING:
    from rich.table import Table

    from facert.data.arrays import IntArray
    from facert.data.rig import Mesh

app = typer.Typer(cls=Group, help="Feature points of a face.", no_args_is_help=True)


@app.callback()
def points() -> None:
    """Feature points that drive a face."""


@app.command("suggest", cls=Command)
def suggest(
    rig_path: Annotated[Path, argument("RIG", "A rig file, .npz or folder of .obj.")],
    count: Annotated[int, option("How many points.", "-n", min=1)] = 80,
    picture: Annotated[Path | None, file_option("Draw them on the face.", metavar="PNG")] = None,
    shapes: SHAPES = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Print the vertices that serve driving best, the most useful first.

    The numbers are those of the picture. The last line has the vertices with commas between them,
    as `facert simulate --vertices` takes them.

    facert points suggest facert-demo/actor.h5 -n 40
    facert points suggest facert-demo/actor.h5 -n 20 --picture points.png
    """
    from facert.errors import reading
    from facert.io.formats import read_rig_file
    from facert.render.sheet import draw_points
    from facert.topology.suggested_points import suggest_points

    require_inputs(rig_path)
    if picture is not None:
        require_name(picture, overwrite)
    rig = read_rig_file(rig_path, shapes)
    with reading(rig_path):
        chosen = suggest_points(rig, count)
    if picture is not None:
        save_picture(draw_points(rig.mesh, chosen), picture, overwrite)
        console.log.info("%s: %s on the face", picture, plural(len(chosen), "point"))
    console.out.print(_table(rig.mesh, chosen))
    console.out.print(",".join(map(str, chosen)))


def _table(mesh: Mesh, chosen: IntArray) -> Table:
    """Number, vertex, place and the number of the opposite point of each."""
    from rich import box
    from rich.table import Table

    from facert.topology.suggested_points import mirror_vertices

    unit = f", {mesh.units}" if mesh.units else ""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("number", "vertex", f"x{unit}", f"y{unit}", f"z{unit}", "opposite"):
        table.add_column(title, justify="right")
    numbers = {vertex: str(number) for number, vertex in enumerate(chosen.tolist(), start=1)}
    opposite = mirror_vertices(mesh.vertices)
    for vertex, number in numbers.items():
        place = (f"{value:.4g}" for value in mesh.vertices[vertex])
        across = int(opposite[vertex])
        partner = "" if across == vertex else numbers.get(across, "")
        table.add_row(number, str(vertex), *place, partner)
    return table
