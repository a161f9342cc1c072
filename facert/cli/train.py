"""``facert train``: learn to retarget from a take and its poses."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from facert.cli import console
from facert.errors import InputError, OutputExistsError, reading
from facert.methods import REGISTRY
from facert.settings import Settings

if TYPE_CHECKING:
    from facert.data import Take
    from facert.optim.monitor import Monitor
    from facert.retargeter import Retargeter

DEFAULT_MODEL = Path("model.safetensors")
DEFAULTS = Settings()


def _setting(name: str, text: str) -> Any:
    """An option that is None unless given, so that it can come before the config file."""
    default = getattr(DEFAULTS, name)
    return typer.Option(
        help=text, show_default="from the data" if default is None else str(default)
    )


def command(
    take: Annotated[
        Path | None,
        typer.Argument(help="Take with poses in some frames; by default the built-in one."),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Model file to write.")
    ] = DEFAULT_MODEL,
    method: Annotated[str | None, _setting("method", "One of " + ", ".join(REGISTRY) + ".")] = None,
    labels: Annotated[
        int | None,
        typer.Option(help="Use only so many of the posed frames, at random.", show_default="all"),
    ] = None,
    unlabelled: Annotated[
        int | None, _setting("unlabelled", "Frames without a pose, and poses without a frame.")
    ] = None,
    latent_dim: Annotated[int | None, _setting("latent_dim", "Latent dimensions.")] = None,
    neighbours: Annotated[
        int | None, _setting("neighbours", "Neighbours in the local linear prior.")
    ] = None,
    sigma_c: Annotated[
        float | None,
        _setting("sigma_c", "Capture noise, in units of the largest deviation of a coordinate."),
    ] = None,
    limits: Annotated[
        str | None,
        _setting("limits", "Clip poses to: auto (declared, else seen), declared, or none."),
    ] = None,
    optimizer: Annotated[str | None, _setting("optimizer", "lbfgs, or scg (the paper's).")] = None,
    seed: Annotated[int | None, _setting("seed", "For every random choice.")] = None,
    device: Annotated[str | None, _setting("device", "cpu or cuda.")] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="TOML file with any of the settings; options given here come first."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the checkpoint beside the output.")
    ] = False,
    curve: Annotated[
        Path | None, typer.Option("--log", help="CSV file for the training curve.")
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Which target of an .npz take that has several.")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace existing output files.")
    ] = False,
) -> None:
    """Learn to retarget from a take's poses, its other frames, and old animation."""
    _require_output(output, curve)
    options = {
        "method": method,
        "labels": labels,
        "unlabelled": unlabelled,
        "latent_dim": latent_dim,
        "neighbours": neighbours,
        "sigma_c": sigma_c,
        "limits": limits,
        "optimizer": optimizer,
        "seed": seed,
        "device": device,
    }

    import facert
    from facert.checkpoint import CheckpointFile, CurveLog, Monitors, checkpoint_path
    from facert.cli.progress import ProgressBar
    from facert.io.toml import read_toml

    settings = DEFAULTS
    if config is not None:
        with reading(config):
            settings = settings.with_changes(read_toml(config))
    with reading("the options"):
        settings = settings.with_changes({k: v for k, v in options.items() if v is not None})

    checkpoint = CheckpointFile(checkpoint_path(output), resume)
    # An interrupted run leaves a model, and a checkpoint to continue from.
    overwrite_model = overwrite or checkpoint.continues
    if output.exists() and not overwrite_model:
        raise OutputExistsError(output)
    data = _read(take, target)
    monitors: list[Monitor] = [checkpoint]
    if curve is not None:
        monitors.append(CurveLog(curve, overwrite, checkpoint.continues))
    with reading(take or "the built-in take"), ProgressBar() as bar:
        retargeter = facert.train(data, settings, Monitors(*monitors, bar))
    retargeter.save(output, overwrite_model)
    if retargeter.figures.get("status", "converged") in ("converged", "stalled"):
        checkpoint.remove()
    _print_table(retargeter, output)
    if retargeter.figures.get("status") == "interrupted":
        console.log.warning("stopped; --resume continues")
        raise typer.Exit(130)


def _require_output(output: Path, curve: Path | None) -> None:
    """Refuse names that cannot be written to, before the work is done."""
    if output.suffix != ".safetensors":
        raise InputError("--output", "a name ending in .safetensors", str(output), "Rename it.")
    if curve is not None and curve.suffix == ".safetensors":
        raise InputError("--log", "a name such as curve.csv", str(curve), "Rename it.")
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            "--output", "a folder that can be made", f"{error.strerror}", "Choose another place."
        ) from error


def _read(path: Path | None, target: str | None) -> Take:
    from facert.io.formats import read_take_file

    if path is not None:
        return read_take_file(path, target=target)
    from facert.demo import training_take

    console.log.info("no take given: training on the built-in demo take")
    return training_take()


def _print_table(retargeter: Retargeter, output: Path) -> None:
    from rich.table import Table
    from rich.text import Text

    figures = retargeter.figures
    # Text, not str: a name in brackets is no markup.
    title = Text(f"{retargeter.settings.method} in {output}")
    table = Table(title=title, show_header=False)
    for name, value in figures.items():
        shown = f"{value:.6g}" if isinstance(value, float) else str(value)
        if isinstance(value, float) and not math.isfinite(value):
            shown = "-"
        table.add_row(name, shown)
    console.out.print(table)
