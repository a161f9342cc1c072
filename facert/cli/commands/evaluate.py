"""``facert eval``: every method on one scale, on a take whose poses are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from facert.cli.shared import console
from facert.cli.shared.options import DEVICE, OVERWRITE, SHAPES, TARGET
from facert.data.text import plural
from facert.errors import InputError, OutputExistsError, reading
from facert.methods.registry import REGISTRY

if TYPE_CHECKING:
    from facert.data.take import Take
    from facert.evaluation.protocol import Problem
    from facert.evaluation.run import Grid
    from facert.evaluation.summary import Row

BUILT_IN = "the built-in take"


class Split(StrEnum):
    """Which frames are tested."""

    random = "random"
    block = "block"


def command(
    take: Annotated[
        Path | None,
        typer.Argument(
            help="Take with true poses, in all frames or some; by default the built-in one."
        ),
    ] = None,
    labels: Annotated[
        str | None,
        typer.Option(
            help="Labelled frames: a..b, a..b:step, or numbers with commas.",
            show_default="10..40, fewer where few are posed",
        ),
    ] = None,
    methods: Annotated[
        str, typer.Option(help="all, or names with commas, of " + ", ".join(REGISTRY) + ".")
    ] = "all",
    repeats: Annotated[int, typer.Option(min=1, help="Random draws of each.")] = 20,
    unlabelled: Annotated[
        str | None,
        typer.Option(
            help="Unlabelled frames, and as many poses: one number, range or list.",
            show_default="100, fewer where there are fewer",
        ),
    ] = None,
    noise: Annotated[
        float, typer.Option(help="Noise, as a share of the largest deviation of a coordinate.")
    ] = 0.0,
    missing: Annotated[
        float, typer.Option(help="Share of the markers to hide in test frames.")
    ] = 0.0,
    split: Annotated[
        Split, typer.Option(help="Test on any other frames, or on other blocks of time.")
    ] = Split.random,
    across: Annotated[Path | None, typer.Option(help="Test on this take instead.")] = None,
    rig: Annotated[
        Path | None, typer.Option(help="The character's rig, for errors of its vertices.")
    ] = None,
    shapes: SHAPES = None,
    test_frames: Annotated[
        int | None, typer.Option(help="Test on so many frames at most.", show_default="all")
    ] = None,
    target: TARGET = None,
    seed: Annotated[int, typer.Option(help="For every random choice.")] = 0,
    device: DEVICE = "cpu",
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes.", show_default="one a core")
    ] = None,
    json_path: Annotated[
        Path | None,
        typer.Option("--json", help="All figures; an interrupted run continues from beside it."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Picture of RMS against labels and unlabelled frames.")
    ] = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Compare methods: draw labels at random, train, and test on the other frames."""
    _require_outputs(json_path, plot, overwrite)
    if across is not None and split is not Split.random:
        raise typer.BadParameter("--across tests on another take: --split does not apply")

    from facert.cli.shared.evaluation_run import Asked, open_journal, run_cells
    from facert.cli.shared.evaluation_table import error_table
    from facert.cli.shared.pictures import save_picture
    from facert.evaluation.advice import advise
    from facert.evaluation.figures import plot_errors
    from facert.evaluation.protocol import Protocol, make_problem
    from facert.evaluation.summary import summarise
    from facert.io.formats import read_rig_file, targets_for
    from facert.models.device import find_device
    from facert.settings import Settings

    asked = Asked.of(_methods(methods), labels, unlabelled, repeats)
    if device != "cpu":
        find_device(device)
    settings = Settings(device=device)
    protocol = Protocol(split.value, noise, missing, test_frames, seed)
    of_take, of_across = targets_for(target, take, across)
    with reading(take or BUILT_IN):
        problem = make_problem(
            _read(take, of_take),
            protocol,
            None if across is None else _read(across, of_across),
            None if rig is None else read_rig_file(rig, shapes),
        )
        grid = asked.grid(problem)
        journal = open_journal(problem, settings, json_path)
        outcomes = run_cells(problem, grid, settings, jobs, journal)
    rows = summarise(outcomes, protocol)
    title = _title(_name(take, target), across, problem, grid)
    console.out.print(error_table(rows, title))
    if json_path is not None:
        files = {"take": take, "target": target, "across": across, "rig": rig, "shapes": shapes}
        _write_json(json_path, {**_plain(files), **_facts(problem, grid)}, rows, overwrite)
    if plot is not None and all(row.rms is None for row in rows):
        console.log.warning("%s: not drawn, as no method could run", plot)
    elif plot is not None:
        save_picture(plot_errors(rows, title), plot, overwrite)
    if journal is not None:
        journal.remove()
    console.out.print(advise(outcomes), markup=False)


def _require_outputs(json_path: Path | None, plot: Path | None, overwrite: bool) -> None:
    """Refuse names that cannot be written to, before hours of work are done."""
    from facert.cli.shared.pictures import require_picture_name

    if json_path is not None and json_path.exists() and not overwrite:
        raise OutputExistsError(json_path)
    if plot is not None:
        require_picture_name(plot, overwrite)


def _methods(text: str) -> tuple[str, ...]:
    """The names in the option, each once."""
    if text == "all":
        return tuple(REGISTRY)
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    unknown = [name for name in names if name not in REGISTRY]
    if unknown:
        expected = "all, or some of " + ", ".join(REGISTRY)
        raise InputError("--methods", expected, repr(unknown[0]), "Choose others.", "the options")
    return names


def _read(path: Path | None, target: str | None) -> Take:
    from facert.demo import training_take
    from facert.io.formats import read_take_file

    return training_take(posed=None) if path is None else read_take_file(path, target=target)


def _name(take: Path | None, target: str | None) -> str:
    if take is None:
        return BUILT_IN
    return take.name if target is None else f"{take.name} ({target})"


def _title(name: str, across: Path | None, problem: Problem, grid: Grid) -> str:
    protocol = problem.protocol
    tested = f"tested on {across.name}" if across is not None else f"{protocol.split} split"
    parts = [name, tested, plural(grid.repeats, "draw")]
    if len(grid.unlabelled) == 1:
        parts.append(f"{grid.unlabelled[0]} unlabelled")
    if protocol.noise:
        parts.append(f"noise {protocol.noise:g}")
    if protocol.missing:
        parts.append(f"{protocol.missing:.0%} hidden")
    return ", ".join(parts)


def _plain(files: Mapping[str, Path | str | None]) -> dict[str, str | None]:
    return {name: None if value is None else str(value) for name, value in files.items()}


def _facts(problem: Problem, grid: Grid) -> dict[str, Any]:
    """The resolved settings, for the JSON file."""
    from dataclasses import asdict

    from facert.data.version import CREATED_BY
    from facert.retarget.model_file import library_versions

    return {
        **asdict(grid),
        **asdict(problem.protocol),
        "split": "across" if problem.across else problem.protocol.split,
        "frames": len(problem.take),
        "controls": problem.controls.names,
        "created_by": CREATED_BY,
        "versions": library_versions(),
    }


def _write_json(path: Path, settings: dict[str, Any], rows: Sequence[Row], overwrite: bool) -> None:
    import json
    from dataclasses import asdict

    from facert.io.atomic import replacing

    content = {"settings": settings, "rows": [asdict(row) for row in rows]}
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path, overwrite) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
