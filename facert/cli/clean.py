"""``facert clean``: markers without gaps and noise."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from numpy.typing import NDArray

from facert.cli import console
from facert.errors import OutputExistsError, reading

if TYPE_CHECKING:
    from facert.cleaning.cleaning import Cleaned
    from facert.data import Take


def command(
    source: Annotated[Path, typer.Argument(metavar="IN", help="Take with gaps and noise.")],
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="Result: .h5, with its uncertainty, or .csv.")
    ],
    model: Annotated[
        Path | None,
        typer.Option("--model", "-m", help="Clean by this model of train, not by the take alone."),
    ] = None,
    no_detect: Annotated[
        bool, typer.Option("--no-detect", help="Believe every marker, even what looks bad.")
    ] = False,
    sigma: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            help="Standard deviation of the capture noise in the take's units; else estimated.",
        ),
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Which target of an .npz take that has several.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT.")] = False,
) -> None:
    """Fill gaps in markers or weights, and remove noise.

    Frozen, swapped and otherwise bad markers are taken as not observed. OUT.h5 has a standard
    deviation for every value as /source/std (not with --model), and /source/filled tells what had
    not been observed. What was never observed stays open.
    """
    if output.exists() and not overwrite:
        raise OutputExistsError(output)
    if model is not None and sigma is not None:
        raise typer.BadParameter("--sigma: a model has learned its own noise", param_hint="--sigma")
    from facert.cli.cleaned_take import read_observed, write_beside

    take = read_observed(source, target, no_detect)
    with reading(source):
        cleaned = _cleaned(take, model, sigma)
    beside: dict[str, NDArray[Any]] = {"/source/filled": cleaned.filled}
    if cleaned.std is not None:
        beside["/source/std"] = cleaned.std
    write_beside(cleaned.take, output, overwrite, beside)
    _print_changes(cleaned, output)


def _cleaned(take: Take, model: Path | None, sigma: float | None) -> Cleaned:
    from facert.cleaning.cleaning import clean, clean_with_model

    if model is None:
        return clean(take, sigma)
    from facert.retargeter import load

    return clean_with_model(take, load(model))


def _print_changes(cleaned: Cleaned, output: Path) -> None:
    source = cleaned.take.source
    unit = f" {cleaned.take.units}" if cleaned.take.units else ""
    share = 100.0 * cleaned.filled.mean()
    console.out.print(f"wrote {output}", markup=False)
    console.out.print(
        f"filled {cleaned.filled.sum()} of {cleaned.filled.size} {source.kind} ({share:.1f} %)",
        markup=False,
    )
    if cleaned.sigma is not None:
        console.out.print(f"capture noise {cleaned.sigma:.2g}{unit}", markup=False)
