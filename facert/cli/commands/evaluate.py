"""``facert eval``: every method on one scale, on a take whose poses are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from facert.cli.shared import console
from facert.cli.shared.completion import lists_of
from facert.cli.shared.files import (
    read_character,
    require_name,
    require_report,
    save_json,
    save_picture,
)
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import (
    DEVICE,
    DRIVERS,
    OVERWRITE,
    RIG,
    SEED,
    SHAPES,
    TARGET,
    argument,
    file_option,
    option,
)
from facert.cli.shared.takes import BUILT_IN, listed_files, short_names
from facert.data.ranges import parse_range
from facert.data.text import did_you_mean, plural
from facert.errors import InputError, reading
from facert.methods.registry import REGISTRY

if TYPE_CHECKING:
    from rich.table import Table

    from facert.evaluation.cells import Outcome
    from facert.evaluation.protocol import Problem
    from facert.evaluation.run import Grid
    from facert.evaluation.table import EvaluationRow
    from facert.io.journal import Journal
    from facert.settings import Settings

WIDEST = 160


def command(
    paths: Annotated[
        list[Path] | None,
        argument(
            "TAKE...",
            "Takes of one actor with true poses, in all frames or some; by default the built-in "
            "one.",
        ),
    ] = None,
    labels: Annotated[
        str | None,
        option(
            "Labelled frames: a..b, a..b:step, or numbers with commas.",
            show_default="10..40, fewer where few are posed",
        ),
    ] = None,
    methods: Annotated[
        str,
        option(
            "all, or names with commas, of " + ", ".join(REGISTRY) + ".",
            autocompletion=lists_of("facert.methods.registry.REGISTRY", "all"),
        ),
    ] = "all",
    repeats: Annotated[int, option("Random draws of each.", min=1)] = 20,
    unlabelled: Annotated[
        str | None,
        option(
            "Unlabelled frames, and as many poses: one number, range or list.",
            show_default="100, fewer where there are fewer",
        ),
    ] = None,
    noise: Annotated[
        float, option("Noise, as a share of the largest deviation of a coordinate.")
    ] = 0.0,
    missing: Annotated[float, option("Share of the markers to hide in test frames.")] = 0.0,
    split: Annotated[
        Literal["random", "block"],
        option("Test on any other frames, or on other blocks of time of each take."),
    ] = "random",
    across: Annotated[Path | None, file_option("Test on this take instead.")] = None,
    rig: RIG = None,
    drivers: DRIVERS = None,
    shapes: SHAPES = None,
    test_frames: Annotated[
        int | None, option("Test on so many frames at most.", show_default="all")
    ] = None,
    target: TARGET = None,
    seed: SEED = 0,
    device: DEVICE = "cpu",
    jobs: Annotated[int | None, option("Processes.", min=1, show_default="one a core")] = None,
    json_path: Annotated[
        Path | None,
        file_option("All figures; an interrupted run continues from beside it.", "--json"),
    ] = None,
    plot: Annotated[
        Path | None, file_option("Picture of RMS against labels and unlabelled frames.")
    ] = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Compare methods: draw labels at random, train, and test on the other frames.

    In the table, "/ best" is the RMS over that of the best method, "of range" the RMS after each
    control's error is divided by its range; "vertex" is the RMS distance of the rig's vertices,
    "95 %" its 95th percentile over frames; "draws" counts those that a method could run, if not
    all.

    facert eval facert-demo/training.h5 --methods ridge,nearest --repeats 3
    facert eval --labels 10..40 --json figures.json --plot figures.png
    """
    paths = paths or []
    require_inputs(*paths, across, rig, drivers)
    if json_path is not None:
        require_report(json_path, overwrite)
    if plot is not None:
        require_name(plot, overwrite)
    if across is not None and split != "random":
        raise typer.BadParameter("--across tests on another take: --split does not apply")

    from facert.data.matching_takes import as_takes
    from facert.demo import training_take
    from facert.evaluation.advice import advise
    from facert.evaluation.defaults import chosen_grid
    from facert.evaluation.figures import plot_errors
    from facert.evaluation.protocol import Protocol, draw, make_problem
    from facert.evaluation.run import journal_beside
    from facert.evaluation.table import summarise
    from facert.io.formats import read_take_file, targets_for
    from facert.models.device import find_device
    from facert.preprocess.label_checks import warn_of_labels
    from facert.settings import Settings

    numbers = _numbers(labels, "--labels"), _numbers(unlabelled, "--unlabelled")
    chosen = _methods(methods)
    if device != "cpu":
        find_device(device)
    settings = Settings(device=device)
    protocol = Protocol(split, noise, missing, test_frames, seed)
    *keys, of_across = targets_for(target, *paths, across)
    takes = [read_take_file(path, target=key) for path, key in zip(paths, keys, strict=True)]
    with reading(listed_files(paths)):
        problem = make_problem(
            as_takes(takes or training_take(posed=None), (), short_names(paths)),
            protocol,
            None if across is None else read_take_file(across, target=of_across),
            read_character(rig, shapes, drivers),
        )
        warn_of_labels(problem.take)
        grid = chosen_grid(problem, chosen, *numbers, repeats)
        journal = None if json_path is None else journal_beside(json_path, problem, settings)
        outcomes = _run(problem, grid, settings, jobs, journal)
    rows = summarise(outcomes, protocol)
    title = _title(paths, target, across, problem, grid)
    console.out.print(_table(rows, title))
    if json_path is not None:
        files = {
            "take": listed_files(paths) if paths else None,
            "target": target,
            "across": across,
            "rig": rig,
            "shapes": shapes,
            "drivers": drivers,
        }
        content = {"settings": _facts(files, problem, grid), "rows": list(map(asdict, rows))}
        save_json(content, json_path, overwrite)
    if plot is not None and all(row.rms is None for row in rows):
        console.log.warning("%s: not drawn, as no method could run", plot)
    elif plot is not None:
        save_picture(plot_errors(rows, title), plot, overwrite)
    if journal is not None:
        journal.remove()
    tested = len(draw(problem, max(grid.labels), max(grid.unlabelled), 0).test)
    few = 2 * len(problem.test.labels) < len(problem.test)
    console.show(advise(outcomes, tested, few))


def _run(
    problem: Problem, grid: Grid, settings: Settings, jobs: int | None, journal: Journal | None
) -> list[Outcome]:
    """The outcomes of all cells, with a note on what to do after Ctrl-C or an unexpected error."""
    from facert.cli.shared.progress import watched
    from facert.evaluation.processes import cores
    from facert.evaluation.run import run

    try:
        outcomes = run(problem, grid, settings, jobs or cores(), journal, console.like_here())
        done = list(watched(outcomes, len(grid), "cells"))
    except KeyboardInterrupt as stop:
        if journal is not None:
            stop.add_note(f"the same command continues from {journal.path}")
        raise
    unexpected = sum(bool(outcome.details) for outcome in done)
    if unexpected:
        cells = plural(unexpected, "cell")
        console.log.warning("%s failed unexpectedly: facert -v eval shows where", cells)
    return done


def _numbers(text: str | None, option: str) -> tuple[int, ...] | None:
    return None if text is None else parse_range(text, option)


def _methods(text: str) -> tuple[str, ...]:
    """The names in the option, each once."""
    if text == "all":
        return tuple(REGISTRY)
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    unknown = [name for name in names if name not in REGISTRY]
    if unknown:
        expected = "all, or some of " + ", ".join(REGISTRY)
        fix = did_you_mean(unknown[0], REGISTRY, "Choose others.")
        raise InputError("--methods", expected, repr(unknown[0]), fix)
    return names


def _title(
    paths: Sequence[Path], target: str | None, across: Path | None, problem: Problem, grid: Grid
) -> str:
    protocol = problem.protocol
    name = " and ".join(short_names(paths)) or BUILT_IN
    parts = [
        name if not paths or target is None else f"{name} ({target})",
        f"tested on {across.name}" if across is not None else f"{protocol.split} split",
        plural(grid.repeats, "draw"),
    ]
    if len(grid.unlabelled) == 1:
        parts.append(f"{grid.unlabelled[0]} unlabelled")
    if protocol.noise:
        parts.append(f"noise {protocol.noise:g}")
    if protocol.missing:
        parts.append(f"{protocol.missing:.0%} hidden")
    return ", ".join(parts)


def _table(rows: Sequence[EvaluationRow], title: str) -> Table:
    """A section for each number of labels and of unlabelled data, its best method in bold.

    Why a method could not run stands below.
    """
    from rich import box
    from rich.measure import Measurement
    from rich.table import Table

    from facert.evaluation.table import Column, columns_of, failures_of, sections_of

    columns = [Column("labels", "labels"), *columns_of(rows)]
    if len({row.unlabelled for row in rows}) > 1:
        columns.insert(1, Column("unlabelled", "unlabelled"))
    table = Table(
        title=console.cell(title),
        title_justify="left",
        caption="\n".join(failures_of(rows)),
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for one in columns:
        justify: Literal["left", "right"] = "left" if one.field == "method" else "right"
        table.add_column(one.title, justify=justify, no_wrap=True)
    for section, least in sections_of(rows):
        for row in section:
            cells = [one.text(row) for one in columns]
            table.add_row(*cells, style="bold" if row is least else None)
        table.add_section()
    # Numbers cut short are of no use: the table is as wide as it must be, in a file as well.
    options = console.out.options.update(width=WIDEST)
    table.width = Measurement.get(console.out, options, table).maximum
    return table


def _facts(files: Mapping[str, object], problem: Problem, grid: Grid) -> dict[str, Any]:
    """The resolved settings, for the JSON file."""
    from facert.data.version import CREATED_BY
    from facert.retarget.model_file import library_versions

    return {
        **{name: None if value is None else str(value) for name, value in files.items()},
        **asdict(grid),
        **asdict(problem.protocol),
        "split": "across" if problem.across else problem.protocol.split,
        "frames": len(problem.take),
        "controls": problem.controls.names,
        "created_by": CREATED_BY,
        "versions": library_versions(),
    }
