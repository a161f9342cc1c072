"""``facert export-script``: a script that brings curves into another program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from facert.cli.shared import console
from facert.cli.shared.files import save_text
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import OVERWRITE, argument, file_option, option


def command(
    program: Annotated[
        Literal["blender", "maya"], argument("blender|maya", "The program that the script is for.")
    ],
    output: Annotated[
        Path | None, option("Write it here instead of to stdout.", "--output", "-o")
    ] = None,
    addon: Annotated[
        bool, option("Blender's add-on, to be installed: also exports poses.", "--addon")
    ] = False,
    drivers_path: Annotated[
        Path | None,
        file_option(
            "Controls that are bones, objects or properties; held in the script.",
            "--drivers",
            metavar="TOML",
        ),
    ] = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Print a Python script that animates a character by curves (.json or .csv) of facert.

    It sets keys on shape keys in Blender, or the attributes of a Maya node, by time. Its first
    lines explain how to run it. Blender's add-on, and the script for Maya, also write keyed poses
    to a table for facert convert --poses.

    facert export-script blender --addon -o facert_addon.py
    facert export-script maya > facert_maya.py
    """
    from facert.io.importers import ADDONS, script

    if addon and program not in ADDONS:
        raise typer.BadParameter(f"--addon is for {' and '.join(ADDONS)}")
    drivers = None
    if drivers_path is not None:
        from facert.io.toml import read_drivers

        require_inputs(drivers_path)
        drivers = read_drivers(drivers_path).tables
    text = script(program, addon, drivers)
    if output is None:
        console.write(text)
        return
    save_text(text, output, overwrite)
    console.show(f"wrote {output}")
