"""``facert export-script``: a script that brings curves into another program."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from facert.cli.shared.options import OVERWRITE


class Program(StrEnum):
    """Programs that there is a script for."""

    blender = "blender"
    maya = "maya"


def command(
    program: Annotated[Program, typer.Argument(metavar="blender|maya")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write it here instead of to stdout.")
    ] = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Print a Python script that keys a character with curves (.json or .csv) of facert.

    It keys the shape keys of a Blender object, or the attributes of a Maya node, by time. How to
    run it stands at its top.

    facert export-script blender -o facert_curves.py
    facert export-script maya > facert_maya.py
    """
    from facert.cli.shared import console
    from facert.io.atomic import replacing
    from facert.io.importers import script

    text = script(program.value)
    if output is None:
        typer.echo(text, nl=False)
        return
    with replacing(output, overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")
    console.show(f"wrote {output}")
