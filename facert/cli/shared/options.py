"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from facert.retarget.options import RetargetOptions
    from facert.retarget.retargeter import Retargeter

TARGET = Annotated[
    str | None, typer.Option("--target", help="Which target of an .npz take that has several.")
]
SHAPES = Annotated[
    str | None, typer.Option("--shapes", help="Which of several sets of shapes of an .npz rig.")
]
OVERWRITE = Annotated[bool, typer.Option("--overwrite", help="Replace existing output files.")]
CONTROLS = Annotated[
    Path | None,
    typer.Option(
        "--controls", help="TOML file with gain, limits and smoothing of single controls."
    ),
]
NO_DETECT = Annotated[
    bool, typer.Option("--no-detect", help="Believe every marker, even what looks bad.")
]
NO_SMOOTH = Annotated[bool, typer.Option("--no-smooth", help="Map every frame as it was measured.")]
SIGMA = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        help="Standard deviation of the capture noise in the take's units; else estimated.",
    ),
]
OUT_DIR = Annotated[
    Path | None,
    typer.Option("--out-dir", help="Folder for the results of several takes, named after them."),
]
ENDING = Annotated[
    str | None,
    typer.Option(
        "--ending",
        help="Of the files in --out-dir, which tells their format.",
        show_default=".h5",
    ),
]
JOBS = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        "-j",
        min=0,
        help="Takes at a time in --out-dir; 0: one a processor core.",
        show_default="1",
    ),
]

DEVICE = Annotated[
    str,
    typer.Option(
        "--device", help="Where the shared models compute: cpu or cuda; all others stay on the CPU."
    ),
]


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
