"""``facert export-script``: a script that brings curves into another program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from facert.cli.shared import console
from facert.cli.shared.files import save_text
from facert.cli.shared.options import OVERWRITE, argument, option


def command(
    program: Annotated[
        Literal["blender", "maya"], argument("blender|maya", "The program that the script is for.")
    ],
    output: Annotated[
        Path | None, option("Write it here instead of to stdout.", "--output", "-o")
    ] = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Print a Python script that animates a character by curves (.json or .csv) of facert.

    It sets keys on the shape keys of a Blender object, or the attributes of a Maya node, by time.
    Its first lines explain how to run it.

    facert export-script blender -o facert_curves.py
    facert export-script maya > facert_maya.py
    """
    from facert.io.importers import script

    text = script(program)
    if output is None:
        typer.echo(text, nl=False)
        return
    save_text(text, output, overwrite)
    console.show(f"wrote {output}")
