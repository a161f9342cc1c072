"""``facert drive``: a few feature points move, the whole face follows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from facert.cli.shared import console
from facert.cli.shared.completion import names_in
from facert.cli.shared.files import require_name, warn_of_unit
from facert.cli.shared.in_and_out import require_inputs
from facert.cli.shared.options import LENGTH_UNITS, OVERWRITE, SHAPES, argument, file_option, option
from facert.data.text import plural
from facert.io.registry import endings

if TYPE_CHECKING:
    from facert.data.rig import Mesh, MeshSequence
    from facert.data.take import Take
    from facert.errors import InputError

ENDINGS = (*endings("write", "mesh sequence"), ".glb")
Fit = Literal["none", "uniform", "axes"]


def command(
    mesh_path: Annotated[Path, argument("MESH", "The face at rest: a rig, .obj or .ply.")],
    points_path: Annotated[Path, argument("POINTS", "A take whose markers are feature points.")],
    output: Annotated[Path, argument("OUT", "A mesh sequence (.h5), or morph targets (.glb).")],
    map_path: Annotated[
        Path | None, file_option("The vertex of each point: chin = 1204.", "--map", metavar="TOML")
    ] = None,
    auto: Annotated[
        bool, option("Each point drives the vertex nearest to it at rest.", "--auto")
    ] = False,
    rest: Annotated[int, option("The frame of POINTS in which their face rests.", min=0)] = 0,
    fit: Annotated[
        Fit, option("Carry over points of another face, scaled as a whole or by axis.")
    ] = "none",
    carry: Annotated[
        bool, option("Parts without a point follow the face rigidly.", "--carry")
    ] = False,
    method: Annotated[
        str,
        option(
            "smooth, framework, literal (the paper's, as printed), laplacian, cotangent, "
            "biharmonic, rbf-linear or rbf-thin-plate.",
            autocompletion=names_in("facert.topology.driving.METHODS"),
        ),
    ] = "smooth",
    tolerance: Annotated[
        float,
        option(
            "For .glb: how far off a vertex may be, in percent of the largest displacement. "
            "More makes fewer targets and a smaller file.",
            min=0.0,
            max=100.0,
        ),
    ] = 0.5,
    in_units: Annotated[
        str | None,
        option(
            "Unit of MESH, instead of the one it states: m, cm, mm, in or ft.",
            autocompletion=LENGTH_UNITS,
        ),
    ] = None,
    shapes: SHAPES = None,
    overwrite: OVERWRITE = False,
) -> None:
    """Deform a face in every frame so that its feature points are where POINTS has them.

    Points are named after their vertices, as in v1204, unless there is a map or --auto.

    facert drive facert-demo/actor.h5 facert-demo/training.h5 f.h5 --auto --carry
    facert drive facert-demo/actor.h5 facert-demo/training.h5 f.glb --auto --carry
    """
    from facert.data.rig import MeshSequence
    from facert.errors import InputError, reading
    from facert.io.formats import read_mesh, read_source_file
    from facert.io.toml import read_toml
    from facert.topology.driving import FaceDriver, LooseParts
    from facert.topology.feature_points import Where, feature_points

    require_inputs(mesh_path, points_path)
    require_name(output, overwrite, ENDINGS)
    if auto and map_path:
        raise typer.BadParameter("give --map or --auto, not both")
    mesh, take = _in_units(read_mesh(mesh_path, shapes), in_units), read_source_file(points_path)
    where: Where = (
        read_toml(map_path, "nose = 1204") if map_path else "nearest" if auto else "names"
    )
    with reading(points_path):
        try:
            points = feature_points(take, mesh, where, rest, fit)
        except InputError as error:
            raise _explained(error, mesh, take, auto, fit) from error
    loose: LooseParts = "carry" if carry else "refuse"
    with reading(mesh_path):
        driver = FaceDriver(mesh.vertices, mesh.faces, points.vertices, method, loose)
    sequence = MeshSequence(
        mesh, take.time, lambda frames: driver.deform(points.positions[frames]), take.fps
    )
    size = _write(sequence, output, tolerance / 100.0, overwrite)
    console.show(
        f"{output}: {plural(len(take), 'frame')} of {len(mesh.vertices)} vertices, "
        f"driven by {plural(len(points.vertices), 'point')}{size}"
    )


def _in_units(mesh: Mesh, unit: str | None) -> Mesh:
    """The mesh in the unit that was given for its numbers."""
    from dataclasses import replace

    from facert.data.units import checked_unit

    return mesh if unit is None else replace(mesh, units=checked_unit(unit, "--in-units"))


def _explained(error: InputError, mesh: Mesh, take: Take, auto: bool, fit: Fit) -> InputError:
    """The error with a fix for points that lie far from the mesh, given the options."""
    from facert.data.units import in_metres
    from facert.errors import InputError

    if error.field != "points":
        return error
    units = [in_metres(mesh.units), in_metres(take.units)]
    if None not in units and units[0] != units[1]:
        fix = f"Bring POINTS to the mesh's unit: facert convert --units {mesh.units}."
    elif auto and fit != "none":
        fix = (
            "--auto works for the points of this very face alone, and --fit cannot change that: it "
            "needs to know the vertices. Give them with --map (or v1204-names) instead of --auto."
        )
    elif auto:
        fix = "For another face's points give --map (or v1204-names) and --fit, instead of --auto."
    else:
        fix = "For another face's points, or other units, add --fit."
    units_of = f"MESH in {mesh.units or 'no unit'}, POINTS in {take.units or 'no unit'}"
    return InputError(error.field, error.expected, f"{error.found} ({units_of})", fix, error.where)


def _write(sequence: MeshSequence, output: Path, tolerance: float, overwrite: bool) -> str:
    """Write in the format of the name's ending; return how large and how far off morphs are."""
    from facert.io.gltf.writer import write_glb
    from facert.io.mesh_sequence import write_mesh_sequence
    from facert.mesh.morphs import compact_morphs

    if output.suffix.lower() != ".glb":
        write_mesh_sequence(sequence, output, overwrite)
        return ""
    warn_of_unit(sequence.neutral.units)
    morphs = compact_morphs(sequence, tolerance)
    write_glb(morphs, output, overwrite)
    unit = f" {sequence.neutral.units}" if sequence.neutral.units else ""
    targets = plural(len(morphs.names), "morph target")
    return f"; {targets}, off by {morphs.error:.2g}{unit} at most"
