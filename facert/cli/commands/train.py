"""``facert train``: learn to retarget from a take and its poses."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from facert.cli.shared import console
from facert.cli.shared.completion import Completion, names_in, words
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    DEFAULT_MODEL,
    OVERWRITE,
    TARGET,
    argument,
    file_option,
    option,
)
from facert.cli.shared.signals import signals
from facert.cli.shared.takes import listed_files, read_takes
from facert.data.typed import choices
from facert.errors import InputError, reading
from facert.io.registry import require_replaceable
from facert.methods.registry import REGISTRY
from facert.settings import (
    DEFAULTS,
    DESCRIBED,
    FINE,
    OF_SHARED,
    SHARED,
    Settings,
    default_text,
)

if TYPE_CHECKING:
    from facert.data.regions import Regions
    from facert.data.take import Take
    from facert.models.optim.monitor import Monitor
    from facert.retarget.retargeter import Retargeter

NAMED_IN = {
    "method": "facert.methods.registry.REGISTRY",
    "source_kernel": "facert.models.kernels.KERNELS",
    "target_kernel": "facert.models.kernels.KERNELS",
}
"""The tables that list what a setting may name."""
SMALL = 0.01  # of numbers below it digits are shown, not decimals


def with_settings(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command an option for each setting but the finest ones; unset, they are None."""
    signature = inspect.signature(function, eval_str=True)
    own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
    made = [_option(name) for name, (_, about) in DESCRIBED.items() if about.group != FINE]
    function.__signature__ = signature.replace(parameters=[*own, *made])  # type: ignore[attr-defined]  # Typer reads it
    return function


def _option(name: str) -> inspect.Parameter:
    """The option of a setting."""
    kind, about = DESCRIBED[name]
    plain: type = next((one for one in (bool, int, float) if one in (kind, *get_args(kind))), str)
    plain = list[str] if name == "neutral" else plain  # one for each take
    methods = f" One of {', '.join(REGISTRY)}." if name == "method" else ""
    made = option(
        about.help + methods,
        show_default=default_text(name),
        metavar="|".join(choices(kind)) or None,
        panel=about.group,
        autocompletion=_completion(name),
    )
    annotation = Annotated[plain | None, made]  # type: ignore[valid-type]  # made of a value
    keyword = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, keyword, default=None, annotation=annotation)


def _completion(name: str) -> Completion | None:
    """What Tab offers for a setting: the words that it knows; else files."""
    kind, _ = DESCRIBED[name]
    if name in NAMED_IN:
        return names_in(NAMED_IN[name])
    return words(*choices(kind)) if choices(kind) else None


@with_settings
def command(
    paths: Annotated[
        list[Path] | None,
        argument(
            "TAKE...",
            "Takes of one actor, with poses in some frames of one at least; by default the "
            "built-in one.",
        ),
    ] = None,
    output: Annotated[Path, option("Model file to write.", "--output", "-o")] = DEFAULT_MODEL,
    predicted: Annotated[
        bool, option("Learn from poses that a model predicted as well.", "--allow-predicted")
    ] = False,
    corrections_only: Annotated[
        bool,
        option(
            "Learn from no frames as predicted beside the corrected ones of a result.",
            "--corrections-only",
        ),
    ] = False,
    animation: Annotated[
        list[Path] | None,
        file_option(
            "Old animation of the character: poses without a frame. Can be repeated.",
            metavar="FILE",
        ),
    ] = None,
    config: Annotated[
        Path | None,
        option("File with any of the settings; options given here come first.", metavar="TOML"),
    ] = None,
    resume: Annotated[
        bool, option("Continue a shared model from its checkpoint.", "--resume", panel=SHARED)
    ] = False,
    start: Annotated[
        Path | None,
        option(
            "Begin at a trained shared model, as after another frame was posed; its settings "
            "are the defaults.",
            metavar="MODEL",
            panel=SHARED,
        ),
    ] = None,
    curve: Annotated[
        Path | None, option("File for the training curve.", "--log", metavar="CSV", panel=SHARED)
    ] = None,
    target: TARGET = None,
    overwrite: OVERWRITE = False,
    **options: Any,
) -> None:
    """Learn to retarget from poses in takes, their other frames, and old animation.

    facert train facert-demo/training.h5
    facert train facert-demo/training.h5 --method gpr -o gpr.safetensors
    """
    paths, animation = paths or [], animation or []
    require_inputs(*paths, *animation, start, config)
    _require_output(output, curve)
    options["regions"] = _regions(regions := options["regions"])

    import facert
    from facert.cli.shared.progress import ProgressBar
    from facert.methods.registry import method_class
    from facert.retarget.checkpoint import CheckpointFile, CurveLog, Monitors, checkpoint_path

    begin = None if start is None else facert.load(start)
    settings = _settings(begin, config, options)
    stepwise = method_class(settings.method).stepwise and settings.regions is None
    _warn_of_idle_settings(settings, DEFAULTS if begin is None else begin.settings)
    if not stepwise:
        idle: dict[str, object] = {"--resume": resume, "--log": curve}
        if not method_class(settings.method).stepwise:
            idle["--start"] = start
        _warn_of_idle_options(settings, idle)
    checkpoint = CheckpointFile(checkpoint_path(output), resume) if stepwise else None
    # An interrupted run leaves a model, and a checkpoint to continue from.
    continues = checkpoint is not None and checkpoint.continues
    overwrite_model = overwrite or continues
    require_replaceable(output, overwrite_model)
    monitors: list[Monitor] = [] if checkpoint is None else [checkpoint]
    if curve is not None and stepwise:
        monitors.append(CurveLog(curve, overwrite, continues))
    takes = read_takes(paths, target, animation, predicted)
    _check_regions(regions, settings.regions, takes.parts[0])
    kept = nullcontext() if stepwise else _noting_loss()
    with kept, reading(listed_files(paths)), ProgressBar() as bar:
        retargeter = facert.train(
            takes, settings, Monitors(*monitors, bar), begin, corrections_only=corrections_only
        )
    retargeter = replace(retargeter, takes=tuple(path.name for path in paths))
    retargeter.save(output, overwrite_model)
    status = retargeter.figures.get("status")
    if checkpoint is not None and status in ("converged", "stalled"):
        checkpoint.remove()
    _print_table(retargeter, output)
    if status == "interrupted":
        console.log.warning("stopped; --resume continues")
        raise typer.Exit(signals.status)


@contextmanager
def _noting_loss() -> Iterator[None]:
    """Note for who stops what learns in one go that nothing of it is kept."""
    try:
        yield
    except KeyboardInterrupt as stop:
        stop.add_note("nothing is kept of what learns in one go; the same command begins anew")
        raise


def _settings(begin: Retargeter | None, config: Path | None, options: dict[str, Any]) -> Settings:
    """Settings of the model to begin at, of the config file, then of the options given."""
    from facert.io.toml import read_toml
    from facert.methods.registry import require_known

    settings = DEFAULTS if begin is None else replace(begin.settings, labels=None)
    if config is not None:
        with reading(config):
            settings = settings.with_changes(read_toml(config, "latent_dim = 8"))
            require_known(settings)
    given = {name: value for name, value in options.items() if value is not None}
    if "neutral" in given:
        given["neutral"] = "; ".join(given["neutral"])
    try:
        return settings.with_changes(given)
    except InputError as error:
        if error.field in given:
            error.field = f"--{error.field.replace('_', '-')}"
        raise


def _regions(given: str | None) -> Regions | str | None:
    """Regions given by the option: the word auto, or those of a file."""
    from facert.data.regions import AUTO
    from facert.io.toml import read_regions

    return given if given in (AUTO, None) else read_regions(Path(given))


def _check_regions(given: str | None, regions: Regions | str | None, take: Take) -> None:
    """Refuse regions that do not fit the take, with the name of the file that they are in."""
    if regions is not None and not isinstance(regions, str) and take.controls is not None:
        with reading(given or "the settings"):
            regions.matched(take.source.names, take.controls.names)


def _warn_of_idle_settings(settings: Settings, unasked: Settings) -> None:
    """Warn of settings that were chosen and are the shared models' alone, if another learns."""
    from facert.methods.registry import method_class

    idle = [name for name in OF_SHARED if getattr(settings, name) != getattr(unasked, name)]
    if idle and not method_class(settings.method).stepwise:
        text = "%s does not use %s: settings of the shared models, sgplvm and ssgplvm"
        console.log.warning(text, settings.method, ", ".join(idle))


def _warn_of_idle_options(settings: Settings, options: dict[str, object]) -> None:
    """Warn of options that do nothing where nothing is trained step by step."""
    idle = [name for name, given in options.items() if given]
    if idle:
        names = " and ".join(idle)
        learner = settings.method if settings.regions is None else f"{settings.method} in regions"
        console.log.warning("%s learns in one go: nothing to do for %s", learner, names)


def _require_output(output: Path, curve: Path | None) -> None:
    """Refuse names that cannot be written to, before the work is done."""
    if output.suffix != ".safetensors":
        raise InputError("--output", "a name ending in .safetensors", str(output), "Rename it.")
    if curve is not None and curve.suffix == ".safetensors":
        raise InputError("--log", "a name such as curve.csv", str(curve), "Rename it.")


def _print_table(retargeter: Retargeter, output: Path) -> None:
    from rich.table import Table

    figures = retargeter.figures
    title = console.cell(f"{retargeter.settings.method} in {output}")
    table = Table(title=title, show_header=False)
    for name, value in figures.items():
        table.add_row(
            console.figure_label(name),
            _shown(value) if isinstance(value, float) else str(value),
        )
    console.out.print(table)
    if any("cross-validation" in name for name in figures):
        text = (
            "the error at poses left out is that of posed frames, mostly extremes, and not that of"
        )
        console.log.info("%s a shot: for that see what facert retarget says of it", text)


def _shown(value: float) -> str:
    """Text of a number: three decimals, or three digits where it is small."""
    if not math.isfinite(value):
        return "-"
    if value and abs(value) < SMALL:
        return f"{value:.3g}"
    return f"{value:.3f}".rstrip("0").rstrip(".")
