"""``facert simulate``: a capture whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from facert.cli.shared import console
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import OVERWRITE, SEED, SHAPES, argument, numbers, option
from facert.data.text import plural


def command(
    rig: Annotated[Path, argument("RIG", "The actor: a rig file, .npz or folder of .obj.")],
    weights: Annotated[Path, argument("WEIGHTS", "Recorded weights, e.g. a Live Link Face .csv.")],
    output: Annotated[Path, argument("OUT", "The take to write, .h5 or .csv.")],
    markers: Annotated[int, option("How many vertices serve as markers.", min=1)] = 40,
    vertices: Annotated[
        str | None, option("These vertices instead, counted from 0.", metavar="I,J,...")
    ] = None,
    noise: Annotated[
        float, option("Share of the largest standard deviation of a coordinate.", min=0.0)
    ] = 0.0,
    missing: Annotated[
        float, option("Share of the markers' positions to hide.", min=0.0, max=1.0)
    ] = 0.0,
    shapes: SHAPES = None,
    seed: SEED = 0,
    overwrite: OVERWRITE = False,
) -> None:
    """Simulate a marker capture by driving a rig with recorded weights.

    The weights that drive the rig are the target of the take: its truth.

    facert simulate facert-demo/character.h5 curves.csv simulated.h5
    facert simulate facert-demo/character.h5 curves.csv gaps.h5 --missing 0.1
    """
    from facert.errors import reading
    from facert.io.formats import read_rig_file, read_source_file, write_take_file
    from facert.io.registry import require_output
    from facert.mesh.capture import simulate_capture

    require_inputs(rig, weights)
    require_output(output, overwrite, "take")
    chosen = None if vertices is None else numbers(vertices, "--vertices")
    actor, performance = read_rig_file(rig, shapes), read_source_file(weights)
    with reading(weights):
        take = simulate_capture(
            actor,
            performance,
            markers=markers,
            vertices=chosen,
            noise=noise,
            missing=missing,
            seed=seed,
        )
    write_take_file(take, output, overwrite)
    controls = 0 if take.controls is None else len(take.controls.names)
    markers_of = f"{plural(len(take), 'frame')} of {plural(len(take.source.names), 'marker')}"
    console.show(f"{output}: {markers_of}, {plural(controls, 'control')}")
