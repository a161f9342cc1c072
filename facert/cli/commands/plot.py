"""``facert plot``: curves of a take's controls."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from facert.cli.shared import console
from facert.cli.shared.files import require_name, save_picture
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import OVERWRITE, TARGET, TRUTH, argument, option
from facert.data.text import plural
from facert.errors import InputError, reading

if TYPE_CHECKING:
    from facert.data.take import Take


def command(
    take_path: Annotated[Path, argument("TAKE", "A take with poses.")],
    output: Annotated[Path, argument("OUT.png", "The picture.")],
    truth_path: TRUTH = None,
    controls: Annotated[
        str, option("For instance jaw_open,'mouth*'; by default the most varying.")
    ] = "",
    target: TARGET = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Draw controls over time, with their uncertainty and the truth.

    facert plot retargeted.h5 curves.png
    facert plot retargeted.h5 mouth.svg --controls 'mouth*,jaw_open'
    """
    from facert.io.formats import read_take_file, targets_for
    from facert.render.faces import require_poses
    from facert.render.plots import plot_controls

    require_inputs(take_path, truth_path)
    require_name(output, overwrite)
    ours, theirs = targets_for(target, take_path, truth_path)
    take = read_take_file(take_path, ours)
    truth = read_take_file(truth_path, theirs) if truth_path else None
    names = [name.strip() for name in controls.split(",")] if controls else []
    with reading(take_path):
        require_poses(take)
    if truth_path and truth:
        with reading(truth_path):
            require_poses(truth)
            take, truth = _comparable(take, truth, names)
    with reading(take_path):
        figure = plot_controls(take, truth, names)
    save_picture(figure, output, overwrite)
    console.show(f"{output}: {plural(len(figure.axes), 'control')}")


def _comparable(take: Take, truth: Take, names: Sequence[str]) -> tuple[Take, Take]:
    """The two takes with the controls that they share, in the spelling of the first."""
    from facert.data.names import fitting
    from facert.data.shared_controls import require_shared

    fix = "Give the truth of this take, or choose another --target."
    shared = require_shared(truth, take, fix)
    lacking = [
        name
        for name in names
        if fitting(name, shared.of_result) and not fitting(name, shared.names)
    ]
    if lacking:
        found = f"none among its {plural(len(shared.names + shared.of_truth), 'control')}"
        raise InputError(
            "--truth", f"poses of {lacking[0]!r}", found, "Leave it out of --controls."
        )
    if shared.left_out:
        console.log.info("%s", shared.left_out)
    return shared.result, shared.truth
