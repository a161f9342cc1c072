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
            help="A take, a rig or a mesh sequence: .h5, .csv (Live Link Face or plain), .npz,"
            " folder of .obj.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="Its ending tells the format: .h5, .livelink.csv (Live Link Face), .csv, or"
            " .glb for a face in motion.",
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
    rig: Annotated[
        Path | None, typer.Option(help="The character's rig, for a take as .glb.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT.")] = False,
) -> None:
    """Convert a take, a rig or a mesh sequence to another format.

    Shapes are matched by name in any spelling; rows without a face are dropped and counted.
    A .csv holds the poses when there are any, else the source. A .glb holds the shapes of the rig
    that a take moves, or the few morph targets that move a mesh as its sequence does.
    """
    from dataclasses import replace

    from facert.data import Rig
    from facert.io import formats

    if output.suffix.lower() == ".glb":
        said = _to_glb(source, output, target, rig, shapes, overwrite)
        console.out.print(f"{output}: {said}", markup=False)
        return
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


def _to_glb(
    source: Path,
    output: Path,
    target: str | None,
    rig_path: Path | None,
    shapes: str | None,
    overwrite: bool,
) -> str:
    """Write a mesh sequence, or a rig in the poses of a take, as a GLB file."""
    from facert.errors import InputError, OutputExistsError, reading
    from facert.io import formats
    from facert.io.glb import write_glb
    from facert.io.mesh_sequence import holds_mesh_sequence, open_mesh_sequence
    from facert.morphs import compact_morphs, rig_morphs
    from facert.view.faces import control_settings

    if output.exists() and not overwrite:
        raise OutputExistsError(output)
    if holds_mesh_sequence(source):
        with open_mesh_sequence(source) as sequence:
            morphs = compact_morphs(sequence)
    else:
        take = formats.read_take_file(source, target)
        with reading(source):
            if rig_path is None:
                raise InputError("--rig", "the character's rig", "none", "Give it with --rig.")
            rig = formats.read_rig_file(rig_path, shapes)
            settings = control_settings(take, rig, range(len(take)))
            morphs = rig_morphs(rig, settings, take.time)
    write_glb(morphs, output, overwrite)
    error = f", off by {morphs.error:.2g} at most" if morphs.error else ""
    return f"{len(morphs.time)} frames of {len(morphs.targets)} morph targets{error}"
