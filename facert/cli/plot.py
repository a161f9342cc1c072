"""``facert plot``: curves of a take's controls."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facert.cli import console
from facert.cli.options import OVERWRITE, TARGET
from facert.wording import plural


def command(
    take_path: Annotated[Path, typer.Argument(metavar="TAKE", help="A take with poses.")],
    output: Annotated[Path, typer.Argument(metavar="OUT.png", help="The picture.")],
    truth_path: Annotated[
        Path | None, typer.Option("--truth", help="A take with the true poses.")
    ] = None,
    controls: Annotated[
        str, typer.Option(help="For instance smile,jaw_open; by default the most varying.")
    ] = "",
    target: TARGET = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Draw controls over time, with their uncertainty and the truth."""
    from facert.cli.pictures import require_picture_name, save_picture
    from facert.errors import reading
    from facert.io.formats import read_take_file
    from facert.view.plots import plot_controls

    require_picture_name(output, overwrite)
    take = read_take_file(take_path, target)
    truth = read_take_file(truth_path, target) if truth_path else None
    names = [name.strip() for name in controls.split(",")] if controls else []
    with reading(take_path):
        figure = plot_controls(take, truth, names)
    save_picture(figure, output, overwrite)
    console.out.print(f"{output}: {plural(len(figure.axes), 'control')}", markup=False)
