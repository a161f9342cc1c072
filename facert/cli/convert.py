"""``facert convert``: any format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facert.cli import console


def command(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="IN",
            help="A take or a rig: .h5, .csv (Live Link Face or plain), .npz, folder of .obj.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="Its ending tells the format: .h5, .livelink.csv (Live Link Face) or .csv.",
        ),
    ],
    target: Annotated[
        str | None, typer.Option(help="Which of several targets of an .npz track.")
    ] = None,
    shapes: Annotated[
        str | None, typer.Option(help="Which of several sets of shapes of an .npz rig.")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(min=1e-3, help="Frames a second, if IN does not say.")
    ] = None,
    units: Annotated[
        str | None, typer.Option(help="Unit of length, e.g. cm, whatever IN says; numbers stay.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT.")] = False,
) -> None:
    """Convert a take or a rig to another format.

    Shapes are matched by name in any spelling; rows without a face are dropped and counted.
    A .csv holds the poses when there are any, else the source.
    """
    from dataclasses import replace

    from facert.data import Rig
    from facert.io import formats

    found = formats.read_any(source, target=target, shapes=shapes, fps=fps)
    if units is not None:
        found = replace(found, units=units)
    if isinstance(found, Rig):
        formats.write_rig_file(found, output, overwrite)
        what = f"a rig with {len(found.neutral)} vertices and {len(found.names)} shapes"
    else:
        formats.write_take_file(found, output, overwrite)
        what = (
            f"a take with {len(found)} frames of {len(found.source.names)} {found.source.kind}"
            f" and {len(found.labels)} poses"
        )
    console.out.print(f"{output}: {what}", markup=False)
