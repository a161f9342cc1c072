"""``facert demo``: a made-up actor, a made-up character, and their performances."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from facert.cli.shared import console
from facert.cli.shared.options import OVERWRITE, SEED, argument
from facert.data.text import for_shell


def command(
    folder: Annotated[Path, argument("DIR", "Where to write.", show_default=True)] = Path(
        "facert-demo"
    ),
    seed: SEED = 0,
    overwrite: OVERWRITE = False,
) -> None:
    """Write a demo: a performance with a few key poses, another to retarget, and both rigs.

    facert demo
    facert demo another-demo --seed 1
    """
    from facert.demo import write_demo

    for path in write_demo(folder, seed, overwrite):
        console.show(f"{path}  {path.stat().st_size / 1000:.0f} kB")

    def at(name: str) -> str:
        return for_shell(str(folder / name))

    model = at("model.safetensors")
    console.out.print("Next:", style="bold")
    console.show(f"  facert train {at('training.h5')} -o {model}")
    console.show(f"  facert retarget {at('performance.h5')} {at('retargeted.h5')} --model {model}")
