"""``facert demo``: a made-up actor, a made-up character, and their performances."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.options import OVERWRITE


def command(
    folder: Annotated[
        Path, typer.Argument(metavar="[DIR]", help="Where to write.", show_default=True)
    ] = Path("facert-demo"),
    seed: Annotated[int, typer.Option(min=0, help="Another seed, other performances.")] = 0,
    overwrite: OVERWRITE = False,
) -> None:
    """Write a demo: a performance with a few key poses, another to retarget, and both rigs."""
    from facert.demo import write_demo

    for path in write_demo(folder, seed, overwrite):
        console.out.print(f"{path}  {path.stat().st_size / 1000:.0f} kB", markup=False)
    model = folder / "model.safetensors"
    console.out.print("Next:", style="bold")
    console.out.print(f"  facert train {folder / 'training.h5'} -o {model}", markup=False)
    console.out.print(
        f"  facert retarget {folder / 'performance.h5'} {folder / 'retargeted.h5'} --model {model}",
        markup=False,
    )
