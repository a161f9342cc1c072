"""``facert retarget``: a performance in, the character's parameters out."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli import console
from facert.cli.train import DEFAULT_MODEL
from facert.errors import OutputExistsError, reading

if TYPE_CHECKING:
    from facert.data import Take


class Mode(StrEnum):
    """How frames are mapped."""

    offline = "offline"
    online = "online"


def command(
    source: Annotated[Path, typer.Argument(metavar="IN", help="Take to retarget.")],
    output: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help="Result: .h5, .csv, or .livelink.csv for ARKit controls."
        ),
    ],
    model: Annotated[
        Path, typer.Option("--model", "-m", help="Model file that train wrote.")
    ] = DEFAULT_MODEL,
    mode: Annotated[
        Mode, typer.Option(help="All frames at once, or one after the other as in a live stream.")
    ] = Mode.offline,
    target: Annotated[
        str | None, typer.Option(help="Which target of an .npz take that has several is the truth.")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing output file.")
    ] = False,
) -> None:
    """Write the character's parameters for every frame of a take."""
    if output.exists() and not overwrite:
        raise OutputExistsError(output)
    import time

    import facert

    retargeter = facert.load(model)
    take = facert.read_take(source, target=target)
    began = time.perf_counter()
    with reading(source):
        result = retargeter.retarget(take, mode.value)
    seconds = time.perf_counter() - began
    facert.write_take(result, output, overwrite)
    console.log.info(
        "%d frames in %.2f s (%.3f ms a frame)", len(take), seconds, 1e3 * seconds / len(take)
    )
    console.out.print(f"wrote {output}", markup=False)
    unseen = retargeter.without_known(take)
    if len(take.labels) and not len(unseen.labels):
        console.log.info("the poses in the input are those it was trained on: no error to tell")
    else:
        _print_errors(unseen, result)


def _print_errors(truth: Take, result: Take) -> None:
    """RMS against the truth, where the input held it for the same controls."""
    from rich.table import Table

    from facert.metrics import compare

    if truth.params is None or truth.controls is None:
        return
    comparison = compare(truth, result)
    if comparison is None:
        console.log.info("the poses in the input are of other controls: not compared")
        return
    table = Table(title=f"RMS against {comparison.frames} poses that it was not trained on")
    table.add_column("controls")
    table.add_column("number", justify="right")
    table.add_column("RMS", justify="right")
    for group in comparison.groups:
        table.add_row(group.name, str(group.controls), f"{group.rms:.4f}")
    table.add_row("all", str(comparison.controls), f"{comparison.rms:.4f}", style="bold")
    console.out.print(table)
