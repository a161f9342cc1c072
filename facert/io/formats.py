"""Takes, rigs and meshes from and to files of any format in the `registry`."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from inspect import signature
from pathlib import Path
from typing import Any, Literal

from facert.data.drivers import Drivers
from facert.data.memory import require_memory
from facert.data.rate import standard_rate
from facert.data.resampling import counted_at, evenly_spaced, held
from facert.data.rig import Mesh, Rig, require_extent
from facert.data.take import Take
from facert.data.text import for_shell, plural
from facert.errors import InputError, reading
from facert.io.guarded import existing_file
from facert.io.registry import (
    FORMATS,
    OWN_ENDINGS,
    Format,
    endings,
    format_of,
    function,
    read,
    require_output,
    unknown_input,
    write,
)

log = logging.getLogger("facert")

_TEXT = 64
"""Bytes of a number in a text, which is joined, cut and coded before it is written."""

TakeOrRig = Literal["take", "rig"]


def read_any(
    path: Path,
    target: str | None = None,
    shapes: str | None = None,
    fps: float | None = None,
    kind: TakeOrRig | None = None,
    or_fps: float | None = None,
    keep: Sequence[str] = (),
    align: bool = False,
    sparse: bool = False,
    drivers: Drivers | None = None,
) -> Take | Rig:
    """Read a take or a rig from any format.

    Parameters
    ----------
    path : Path
    target, shapes : str, optional
        Which target, or set of shapes, of an .npz file that holds several; which animation of a
        glTF file.
    fps : float, optional
        Frames a second of a take, whatever the file states: its frames are counted anew.
    kind : {"take", "rig"}, optional
        What to read of a file that can hold both, as glTF does; by default the rig.
    or_fps : float, optional
        Frames a second of a file that does not state it, where there is no `fps`.
    keep : sequence of str
        Columns of a table that are weights, though they look like a clock, a counter or a flag.
    align : bool
        Move shapes into register with the neutral where they are meshes; else they are logged.
    sparse : bool
        Whether the rows of a foreign table or track are poses of single frames, far apart.
    drivers : Drivers, optional
        Of nodes of a rig in a glTF file.

    Raises
    ------
    InputError
        For an unknown ending, a file of another kind than its ending, a `target` of a take that
        cannot have several, or an `fps` that uneven times contradict.
    """
    path = Path(path)
    if not path.is_dir():
        existing_file(path)
    found = format_of(path, "read", "take", "rig")
    if found is None:
        raise unknown_input(path)
    if path.is_file() and not path.name.lower().endswith(found.endings):
        log.warning("%s: read as %s, which it is by its content", path.name, found.endings[0])
    held = read(found.kind_of, path, kind) if found.kind_of else next(iter(found.read))
    reader = found.read[held]
    if held == "take" and target:
        _require_targets(found, path)
    fps = None if fps is None else standard_rate(fps)
    options: dict[str, Any] = {"target": target, "shapes": shapes, "fps": fps or or_fps}
    options |= {"keep": keep, "align": align, "sparse": sparse, "drivers": drivers}
    taken = signature(function(reader)).parameters.keys() & options.keys()
    if align and "align" not in taken:
        fix = "Leave it out: the shapes are displacements."
        raise InputError("--align-shapes", "a folder of OBJ files", held, fix, where=str(path))
    if drivers is not None and "drivers" not in taken:
        fix = "Leave it out: only these files have bones."
        raise InputError("--drivers", "a .glb, .gltf or .vrm", path.name, fix, where=str(path))
    content: Take | Rig = read(reader, path, **{name: options[name] for name in taken})
    if isinstance(content, Rig):
        with reading(path):
            require_extent(content.neutral)
    return content if fps is None else _at_rate(content, fps, "fps" in taken, path)


def _at_rate(found: Take | Rig, fps: float, asked: bool, path: Path) -> Take | Rig:
    """What was read, at so many frames a second; `asked`: its reader knew of them."""
    with reading(path):
        if isinstance(found, Rig):
            found_instead = "a rig, which has no frames"
            raise InputError("--in-fps", "a take", found_instead, "Leave it out.")
        return found if asked and found.fps == fps else counted_at(found, fps)


def _require_targets(found: Format, path: Path) -> None:
    """Refuse to choose a target where a take has but one."""
    if not _has_targets(found):
        able = ", ".join(e for one in FORMATS if _has_targets(one) for e in one.endings)
        fix = "Leave it out: there is nothing to choose."
        raise InputError("--target", f"a take in {able}", path.suffix, fix, where=str(path))


def _has_targets(one: Format) -> bool:
    return "take" in one.read and "target" in signature(function(one.read["take"])).parameters


def read_take_file(
    path: Path, target: str | None = None, fps: float | None = None, keep: Sequence[str] = ()
) -> Take:
    """Read a take from any format; see `read_any`.

    Raises
    ------
    InputError
        Also when the file holds a rig.
    """
    return require_take(read_any(path, target=target, fps=fps, kind="take", keep=keep), path)


def require_take(found: Take | Rig, path: Path) -> Take:
    """What was read, if it is a take; raises `InputError` naming the file when it is a rig."""
    if isinstance(found, Rig):
        fix = "Give a performance, or a table of poses: a rig goes to --rig."
        raise InputError("file", "a take", "a rig", fix, where=str(path))
    return found


def targets_of(path: Path) -> dict[str, tuple[str, ...]]:
    """The targets of a take among which ``--target`` chooses, and the controls of each.

    Empty where there is nothing to choose.
    """
    found = format_of(Path(path), "read", "take")
    if found is None or not found.targets:
        return {}
    targets: dict[str, tuple[str, ...]] = read(found.targets, Path(path))
    return targets if len(targets) > 1 else {}


def nodes_of(path: Path) -> tuple[str, ...]:
    """Names of the nodes of a character that drivers may move; empty where there are none."""
    found = format_of(Path(path), "read", "rig")
    if found is None or not found.nodes:
        return ()
    nodes: tuple[str, ...] = read(found.nodes, Path(path))
    return nodes


def targets_for(target: str | None, *paths: Path | None) -> list[str | None]:
    """The ``--target`` of each of several takes: it is for those that can have several targets.

    Where none can, it is for all of them, so that reading the first refuses it.
    """
    formats = [format_of(Path(path), "read", "take") if path else None for path in paths]
    able = [one is not None and _has_targets(one) for one in formats]
    return [target if can or not any(able) else None for can in able]


def read_source_file(path: Path, target: str | None = None, controls: Sequence[str] = ()) -> Take:
    """Read a take for its source: of several targets the one with these controls, else none.

    Raises
    ------
    InputError
        As `read_take_file` does.
    """
    targets = targets_of(path) if target is None else {}
    if targets:
        fitting = (key for key, names in targets.items() if set(names) == set(controls))
        target = next(fitting, "")  # the source alone
        chosen = f"the model's is {target}" if target else "none is read"
        log.info("%s has several targets (%s): %s", Path(path).name, ", ".join(targets), chosen)
    return read_take_file(path, target)


def read_rig_file(path: Path, shapes: str | None = None, drivers: Drivers | None = None) -> Rig:
    """Read a rig from any format; see `read_any`.

    Raises
    ------
    InputError
        Also when the file holds a take.
    """
    path = Path(path)
    found: Take | Rig | None = None
    if not path.exists() or format_of(path, "read", "rig") or not format_of(path, "read", "take"):
        found = read_any(path, shapes=shapes, kind="rig", drivers=drivers)
    if not isinstance(found, Rig):
        fix = f"Give a rig: {', '.join(endings('read', 'rig'))}, or a folder of .obj files."
        raise InputError("file", "a rig", "a take", fix, where=str(path))
    return found


def read_mesh(path: Path, shapes: str | None = None) -> Mesh:
    """Read a mesh at rest: from a format of meshes, else of a rig; see `read_any`.

    The vertices keep the file's order; quads and polygons become triangle fans.
    """
    found = format_of(Path(path), "read", "mesh")
    if found is None:
        return read_rig_file(path, shapes).mesh
    mesh: Mesh = read(found.read["mesh"], Path(path))
    with reading(path):
        require_extent(mesh.vertices)
    return mesh


def write_take_file(take: Take, path: Path, overwrite: bool = False) -> int:
    """Write a take in the format that the name's ending asks for; the number of frames written.

    Formats that are played row by row get even rows, see `facert.data.resampling.evenly_spaced`.

    Raises
    ------
    InputError
        For an ending that cannot be written, or a take that the format cannot hold.
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    path = Path(path)
    missing = require_output(path, overwrite, "take").missing
    if path.suffix.lower() not in OWN_ENDINGS:
        _warn_of_loss(take, path)
    with reading(path):
        take = evenly_spaced(take) if missing else take
        take = held(take) if missing == "held" else take
    if path.suffix.lower() not in OWN_ENDINGS:
        _require_room(take)
    write("take", take, path, overwrite)
    return len(take)


def _require_room(take: Take) -> None:
    """Refuse to make a text, as others formats are, that memory could not hold."""
    poses = 0 if take.controls is None else len(take.controls.names)
    cells = len(take) * (poses or take.source.values[0].size)
    require_memory(_TEXT * cells, "output", "Write .h5, or fewer frames.")


def _warn_of_loss(take: Take, path: Path) -> None:
    """Warn of a file of poses alone that is to hold a few: read again, it would be a source."""
    if not 0 < len(take.labels) < len(take):
        return
    back = f"facert convert RECORDING OUT.h5 --poses {for_shell(path.name)} brings both together"
    if path.name.lower().endswith(".livelink.csv"):  # the rest of its rows are dropped when read
        back = "only a .csv, .json or .h5 keeps which frames they belong to"
    poses = plural(len(take.labels), "pose")
    log.warning("%s holds %s and not what was recorded: %s", path.name, poses, back)


def write_rig_file(rig: Rig, path: Path, overwrite: bool = False) -> None:
    """Write a rig in facert's own format; see `facert.mesh.morphs.Morphs` for others.

    Raises
    ------
    InputError
        For another ending.
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    write("rig", rig, Path(path), overwrite)
