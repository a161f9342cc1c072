"""Options that several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from facert.cli.shared.completion import names_in, result_endings, words
from facert.cli.shared.help import FILES

if TYPE_CHECKING:
    from facert.retarget.options import RetargetOptions
    from facert.retarget.retargeter import Retargeter

LENGTH_UNITS = names_in("facert.data.units.METRES")
AXES = words("x", "y", "z")
DEFAULT_MODEL = Path("model.safetensors")


def option(text: str, *names: str, panel: str | None = None, **more: Any) -> Any:
    """An option by its help, and its names where they are not those of the parameter."""
    return typer.Option(*names, help=text, rich_help_panel=panel, **more)


def file_option(text: str, *names: str, **more: Any) -> Any:
    """An option in the panel of files."""
    return option(text, *names, panel=FILES, **more)


def argument(name: str, text: str = "", **more: Any) -> Any:
    """An argument by its name in the help."""
    return typer.Argument(metavar=name, help=text, **more)


MODEL = Annotated[Path, option("Model file that train wrote.", "--model", "-m")]
SEED = Annotated[int, option("For every random choice.", "--seed", min=0)]
AS_JSON = Annotated[bool, option("Print JSON, for programs.", "--json")]
NO_DETECT = Annotated[
    bool, option("Take every marker as observed, even what looks bad.", "--no-detect")
]
NO_SMOOTH = Annotated[
    bool, option("Map the measured frames, without removing their noise.", "--no-smooth")
]
SIGMA = Annotated[
    float | None,
    option("Standard deviation of the capture noise in the take's units; else estimated.", min=0.0),
]
DEVICE = Annotated[
    str,
    option(
        "Where the shared models compute: cpu or cuda; all others stay on the CPU.",
        "--device",
        autocompletion=words("cpu", "cuda"),
    ),
]
HOST = Annotated[str, option("Address of the page; 0.0.0.0 for other machines as well.", "--host")]
PORT = Annotated[int, option("Port of the page, or the next free one.", "--port")]


TARGET = Annotated[
    str | None,
    file_option("Which target of an .npz take that has several.", "--target", metavar="KEY"),
]
SHAPES = Annotated[
    str | None,
    file_option(
        "Which set of shapes of an .npz rig; expressions of a .vrm.", "--shapes", metavar="KEY"
    ),
]
RIG = Annotated[Path | None, file_option("The character's rig.", "--rig")]
DRIVERS = Annotated[
    Path | None,
    file_option("Controls that move bones or objects of the rig.", "--drivers", metavar="TOML"),
]
TRUTH = Annotated[Path | None, file_option("The true poses of the same frames.", "--truth")]
ACTOR = Annotated[
    Path | None,
    file_option(
        "The actor's rig, to draw tracked weights; none: no face of his.",
        "--actor",
        show_default="facert's own, for ARKit's shapes",
    ),
]
VIDEO = Annotated[
    Path | None, file_option("The performer's video, beside the face, by time.", "--video")
]
VIDEO_START = Annotated[
    float | None,
    file_option(
        "When the video begins, in seconds of the take.",
        "--video-start",
        show_default="by both timecodes, else 0",
        metavar="SECONDS",
    ),
]
CONTROLS = Annotated[
    Path | None,
    file_option("Gain, limits and smoothing of single controls.", "--controls", metavar="TOML"),
]
OUT_DIR = Annotated[
    Path | None,
    file_option(
        "Folder for the results of several takes, named after them.", "--out-dir", metavar="DIR"
    ),
]
ENDING = Annotated[
    str | None,
    file_option(
        "Of the files in --out-dir; their format goes by it.",
        "--ending",
        show_default=".h5",
        autocompletion=result_endings,
    ),
]
JOBS = Annotated[
    int | None,
    file_option(
        "Takes at a time in --out-dir; 0: one a processor core.",
        "--jobs",
        "-j",
        min=0,
        show_default="1",
    ),
]
OVERWRITE = Annotated[
    bool, file_option("Replace output files that exist, if facert wrote them.", "--overwrite")
]


def numbers(text: str, option: str) -> list[int]:
    """The whole numbers of an option, with commas between them."""
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        fix = "give numbers with commas, as in 0,12,30"
        raise typer.BadParameter(fix, param_hint=option) from None


@dataclass(frozen=True)
class MappingOptions:
    """Options of a command that maps takes through a model."""

    controls: Path | None
    no_detect: bool
    no_smooth: bool
    sigma: float | None
    neutral: str | None = None

    def __call__(self, retargeter: Retargeter) -> RetargetOptions:
        """Retargeting options for a model, with its controls' adjustments read from the file."""
        from facert.data.ranges import parse_frames
        from facert.errors import reading
        from facert.io.toml import read_toml
        from facert.retarget.options import Adjustments, RetargetOptions

        adjustments = None
        if self.controls is not None:
            with reading(self.controls):
                table = read_toml(self.controls, '["jaw*"] gain = 1.2')
                adjustments = Adjustments.of(table, retargeter.controls.names)
        neutral = None if self.neutral is None else parse_frames(self.neutral, "--neutral")
        return RetargetOptions(
            detect=not self.no_detect,
            smooth=not self.no_smooth,
            sigma=self.sigma,
            neutral=neutral,
            adjustments=adjustments,
        )
