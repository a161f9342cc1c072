"""``facert propagate``: a few posed frames make the whole performance, without training."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from facert.cli.shared import console
from facert.cli.shared.completion import names_in
from facert.cli.shared.in_and_out import require_in_and_out, require_inputs
from facert.cli.shared.options import OVERWRITE, TARGET, argument, file_option, numbers, option
from facert.data.text import plural
from facert.io.registry import listed
from facert.settings import LimitRule

if TYPE_CHECKING:
    from facert.data.arrays import IntArray
    from facert.data.take import Take


def command(
    source: Annotated[Path, argument("IN", "A take: markers or weights, some frames posed.")],
    output: Annotated[Path, argument("OUT", f"Result: {listed('write', 'take')}.")],
    keys: Annotated[str, option("Key frames, as in 0,12,30; by default all that are posed.")] = "",
    every: Annotated[
        int | None, option("Instead: every so many frames, and the last.", min=1)
    ] = None,
    positions: Annotated[
        Path | None,
        file_option(
            "The character's feature points: its markers in the key frames, instead of poses."
        ),
    ] = None,
    method: Annotated[
        str,
        option(
            "residual, path, framework (the paper's), literal (as printed), laplacian, "
            "rbf-linear, rbf-thin-plate, ridge, affine or spline.",
            autocompletion=names_in("facert.topology.propagation.METHODS"),
        ),
    ] = "residual",
    window: Annotated[
        int | None, option("Frames of a window of time, odd.", show_default="9 or 15")
    ] = None,
    dim: Annotated[
        int | None, option("Directions of motion in a window.", min=1, show_default="5 or 3")
    ] = None,
    limits: Annotated[
        LimitRule,
        option(
            "Clip poses to: auto (declared, else the range of the key poses and old "
            "animation), declared, or none, which keeps what goes beyond."
        ),
    ] = "auto",
    target: TARGET = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Write poses, or feature points, for every frame of a take from a few key frames.

    facert propagate facert-demo/training.h5 whole.h5
    facert propagate facert-demo/training.h5 path.h5 --method path
    """
    import numpy as np

    from facert.errors import reading
    from facert.io.formats import read_source_file, read_take_file, write_take_file
    from facert.topology.propagated_takes import Propagation, propagate_poses, propagate_positions

    require_inputs(positions)
    require_in_and_out(source, output, overwrite, "take", in_place=True)
    how = Propagation(method, window, dim, limits)
    if positions is None:
        take = read_take_file(source, target)
        with reading(source):
            chosen = _keys(keys, every, take.labels, len(take))
            result = propagate_poses(take, chosen, how)
    else:
        take, points = read_source_file(source, target), read_source_file(positions)
        with reading(source):
            seen = np.flatnonzero(points.source.valid.all(axis=1))
            chosen = _keys(keys, every, seen, len(points))
            result = propagate_positions(take, points, chosen, how)
    write_take_file(result, output, overwrite)
    made = f"{plural(len(result), 'frame')} from {plural(len(chosen), 'key frame')}"
    console.show(f"{output}: {made}")
    error = _error(result, take if positions is None else points, chosen)
    if error:
        console.show(error)


def _keys(keys: str, every: int | None, posed: IntArray, frames: int) -> list[int]:
    """The key frames that are asked for, or all that are posed."""
    from facert.errors import InputError
    from facert.topology.keyed import even_keys

    if keys and every:
        raise typer.BadParameter("give --keys or --every, not both")
    if every:
        return [int(key) for key in even_keys(frames, every)]
    if keys:
        return sorted(set(numbers(keys, "--keys")))
    if len(posed) == frames:
        raise InputError(
            "--keys", "some frames", "a pose in all of them", "Choose with --keys or --every 10."
        )
    return [int(frame) for frame in posed]


def _error(result: Take, truth: Take, keys: list[int]) -> str:
    """RMS error at frames other than keys whose truth is known, as text; empty if none is."""
    import numpy as np

    from facert.data.arrays import rms

    of_poses = result.params is not None and truth.params is not None
    found = result.params if of_poses else result.source.values
    known = truth.params if of_poses else truth.source.values
    assert found is not None
    assert known is not None
    errors = (found - known).reshape(len(found), -1)
    rest = np.setdiff1d(np.flatnonzero(~np.isnan(errors).any(axis=1)), keys)
    if not len(rest):
        return ""
    others = plural(len(rest), "other frame")
    return f"RMS against the {others} that the input holds: {rms(errors[rest]):.4f}"
