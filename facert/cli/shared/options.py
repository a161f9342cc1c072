"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from facert.cli.shared.help import FILES

if TYPE_CHECKING:
    from facert.retarget.options import RetargetOptions
    from facert.retarget.retargeter import Retargeter

DEFAULT_MODEL = Path("model.safetensors")

MODEL = Annotated[Path, typer.Option("--model", "-m", help="Model file that train wrote.")]
SEED = Annotated[int, typer.Option("--seed", min=0, help="For every random choice.")]
AS_JSON = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
NO_DETECT = Annotated[
    bool, typer.Option("--no-detect", help="Take every marker as observed, even what looks bad.")
]
NO_SMOOTH = Annotated[bool, typer.Option("--no-smooth", help="Map every frame as it was measured.")]
SIGMA = Annotated[
    float | None,
    typer.Option(
        min=0.0, help="Standard deviation of the capture noise in the take's units; else estimated."
    ),
]
DEVICE = Annotated[
    str,
    typer.Option(
        "--device", help="Where the shared models compute: cpu or cuda; all others stay on the CPU."
    ),
]
HOST = Annotated[
    str, typer.Option("--host", help="Address of the page; 0.0.0.0 for other machines as well.")
]
PORT = Annotated[int, typer.Option("--port", help="Port of the page, or the next free one.")]


def file_option(name: str, text: str, *names: str, **more: Any) -> Any:
    """An option in the panel of files."""
    return typer.Option(name, *names, help=text, rich_help_panel=FILES, **more)


TARGET = Annotated[
    str | None,
    file_option("--target", "Which target of an .npz take that has several.", metavar="KEY"),
]
SHAPES = Annotated[
    str | None,
    file_option("--shapes", "Which of several sets of shapes of an .npz rig.", metavar="KEY"),
]
RIG = Annotated[Path | None, file_option("--rig", "The character's rig.")]
TRUTH = Annotated[Path | None, file_option("--truth", "The true poses of the same frames.")]
ACTOR = Annotated[Path | None, file_option("--actor", "The actor's rig, to draw tracked weights.")]
CONTROLS = Annotated[
    Path | None,
    file_option("--controls", "Gain, limits and smoothing of single controls.", metavar="TOML"),
]
OUT_DIR = Annotated[
    Path | None,
    file_option(
        "--out-dir", "Folder for the results of several takes, named after them.", metavar="DIR"
    ),
]
ENDING = Annotated[
    str | None,
    file_option(
        "--ending", "Of the files in --out-dir; their format goes by it.", show_default=".h5"
    ),
]
JOBS = Annotated[
    int | None,
    file_option(
        "--jobs",
        "Takes at a time in --out-dir; 0: one a processor core.",
        "-j",
        min=0,
        show_default="1",
    ),
]
OVERWRITE = Annotated[bool, file_option("--overwrite", "Replace existing output files.")]


def chosen_options(
    retargeter: Retargeter,
    *,
    controls: Path | None,
    no_detect: bool,
    no_smooth: bool,
    sigma: float | None = None,
    neutral: str | None = None,
) -> RetargetOptions:
    """What the options ask for, of a take that goes through this model."""
    from facert.data.ranges import parse_frames
    from facert.errors import reading
    from facert.io.toml import read_toml
    from facert.retarget.options import Adjustments, RetargetOptions

    adjustments = None
    if controls is not None:
        with reading(controls):
            adjustments = Adjustments.of(
                read_toml(controls, '["jaw*"] gain = 1.2'), retargeter.controls.names
            )
    return RetargetOptions(
        detect=not no_detect,
        smooth=not no_smooth,
        sigma=sigma,
        neutral=None if neutral is None else parse_frames(neutral, "--neutral"),
        adjustments=adjustments,
    )
