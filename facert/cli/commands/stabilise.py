"""``facert stabilise``: markers without the head's motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from facert.cli.shared import console
from facert.cli.shared.files import read_observed, require_other_file, write_beside
from facert.cli.shared.in_and_out import require_in_and_out
from facert.cli.shared.options import NO_DETECT, OVERWRITE, TARGET, argument, file_option, option
from facert.data.text import plural
from facert.errors import InputError, reading

if TYPE_CHECKING:
    from facert.data.arrays import FloatArray
    from facert.preprocess.head_motion import Stabilised


def command(
    source: Annotated[Path, argument("IN", "Take with head motion.")],
    output: Annotated[Path, argument("OUT", "Result: .h5, with the motion, or .csv.")],
    stable: Annotated[
        str,
        option(
            "Markers that hardly move against the skull, three at least; automatic: those "
            "whose distances to each other change least.",
            metavar="NAME,NAME,...",
        ),
    ] = "automatic",
    reference: Annotated[
        str, option("Frame whose head pose all get, counted from 0.", metavar="FRAME|mean")
    ] = "mean",
    like: Annotated[
        Path | None,
        file_option("A take of the same actor that was stabilised before, for the same head pose."),
    ] = None,
    no_detect: NO_DETECT = False,
    target: TARGET = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Remove the head's rigid motion from markers.

    Markers that are frozen, swapped, at zero, elsewhere or absurd, and single spikes, are taken as
    not observed. Frames that show fewer than three stable markers get the motion of their
    neighbours in time. OUT.h5 keeps the motion as /source/head (T, 4, 4): it takes the stabilised
    markers to the recorded ones.

    facert stabilise facert-demo/performance.h5 stable.h5
    facert stabilise facert-demo/performance.h5 as-first.h5 --reference 0
    """
    from facert.io.formats import read_source_file, targets_for
    from facert.preprocess.head_motion import stabilise

    require_in_and_out(source, output, overwrite, "take", in_place=True)
    require_other_file(source, output, "IN")
    if like is not None and reference != "mean":
        raise typer.BadParameter("--like and --reference both choose the head pose: give one")
    ours, theirs = targets_for(target, source, like)
    pose = _frame(reference) if like is None else read_source_file(like, theirs)
    take = read_observed(source, ours, no_detect)
    with reading(source):
        found = stabilise(take, _names(stable), pose)
    if found.interpolated.any():
        console.log.warning(
            "head motion interpolated in %s with fewer than three stable markers",
            plural(int(found.interpolated.sum()), "frame"),
        )
    write_beside(found.take, output, overwrite, {"/source/head": found.head.matrices})
    _print_removed(found, output)


def _names(stable: str) -> list[str] | Literal["automatic"]:
    if stable.strip() == "automatic":
        return "automatic"
    return [name.strip() for name in stable.split(",") if name.strip()]


def _frame(reference: str) -> int | Literal["mean"]:
    if reference == "mean":
        return "mean"
    if not reference.isdecimal():
        raise InputError("--reference", "a frame or mean", repr(reference), "Give one of these.")
    return int(reference)


def _print_removed(found: Stabilised, output: Path) -> None:
    unit = f" {found.take.units}" if found.take.units else ""
    lines = (
        f"wrote {output}",
        f"removed rotation: {_size(found.head.degrees, ' degrees')}",
        f"removed shift: {_size(found.shifts, unit)}",
        f"stable markers: {', '.join(found.names)}",
        f"motion left in them: {found.residual:.2g}{unit} RMS",
    )
    for line in lines:
        console.show(line)


def _size(values: FloatArray, unit: str) -> str:
    root = float((values**2).mean() ** 0.5)
    return f"{root:.2f}{unit} RMS, {float(values.max()):.2f}{unit} at most"
