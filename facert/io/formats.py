"""The one table of file formats for takes and rigs: what a name's ending means.

Meshes at rest and in motion have rooms of their own: `mesh`, `mesh_sequence`, `glb`, `usd`.

=================  =================================  ==========================================
ending             read                               written
=================  =================================  ==========================================
``.h5 .hdf5``      take or rig, by its ``format``     take or rig, with all that it holds
``.livelink.csv``  Live Link Face CSV                 poses, else source weights, of ARKit names
``.csv``           Live Link Face CSV when the        poses, else the source, as a plain table
                   header says so; else a table
``.json``          curves, as Audio2Face writes       poses, else source weights
``.txt``           Face Cap recording                 -
``.c3d .trc``      markers                            -
``.glb .gltf``     a rig of morph targets; the take   -
                   of their animation
``.npz``           take or rig, by its keys           -
a folder           OBJ files: a rig                   -
=================  =================================  ==========================================
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from facert.data.rig import Rig
from facert.data.take import Take
from facert.data.text import plural
from facert.errors import InputError, OutputExistsError, reading
from facert.io import npz
from facert.io.c3d import read_c3d
from facert.io.curves import read_curves, write_curves
from facert.io.facecap import read_facecap
from facert.io.gltf_rig import read_gltf_rig
from facert.io.gltf_take import holds_animation, read_gltf_take
from facert.io.hdf5 import open_guarded
from facert.io.livelink import is_livelink, read_livelink, write_livelink
from facert.io.obj import read_obj_folder
from facert.io.rig import FORMAT as RIG_FORMAT
from facert.io.rig import read_rig, write_rig
from facert.io.table import read_table, write_table
from facert.io.take import read_take, write_take
from facert.io.text import existing_file, read_header
from facert.io.trc import read_trc

log = logging.getLogger("facert")

Kind = Literal["take", "rig"]

HDF5_ENDINGS = (".h5", ".hdf5")
GLTF_ENDINGS = (".glb", ".gltf")
_WITH_TARGETS = (".npz", *GLTF_ENDINGS)
TAKE_OUTPUTS = (*HDF5_ENDINGS, ".livelink.csv", ".csv", ".json")
TAKE_ENDINGS = (*HDF5_ENDINGS, ".csv", ".json", ".txt", ".c3d", ".trc", *GLTF_ENDINGS, ".npz")

_ADVICE = {
    ".fbx": "Export it as .glb from Blender, Maya or Unreal.",
    ".bvh": "Export it as .c3d or .trc.",
    ".mp4": "Track the face first, e.g. with Live Link Face or Face Cap.",
    ".mov": "Track the face first, e.g. with Live Link Face or Face Cap.",
    ".obj": "Give the folder with neutral.obj and one OBJ file a shape.",
    ".safetensors": "This is a model: give it with --model.",
    ".usd": "facert writes USD and does not read it: export a .glb.",
    ".usda": "facert writes USD and does not read it: export a .glb.",
    ".usdc": "facert writes USD and does not read it: export a .glb.",
}


def read_any(
    path: Path,
    target: str | None = None,
    shapes: str | None = None,
    fps: float | None = None,
    kind: Kind | None = None,
) -> Take | Rig:
    """Read a take or a rig from any format.

    Parameters
    ----------
    path : Path
    target, shapes : str, optional
        Which target, or set of shapes, of an .npz file that holds several; which animation of a
        glTF file.
    fps : float, optional
        Frames a second of a file that does not say.
    kind : {"take", "rig"}, optional
        What to read of a file that can hold both, as glTF does; by default the rig.

    Raises
    ------
    InputError
        For an unknown ending, a file that is not what its ending says, or a `target` of a take
        that cannot have several.
    """
    path = Path(path)
    found: Kind = "rig" if _holds_rig(path) else "take"
    if path.suffix.lower() in GLTF_ENDINGS:
        if kind is None and holds_animation(path):
            log.info("%s: this is the rig; its animation is a take as well", path.name)
        found = kind or found
    return _read_rig(path, shapes) if found == "rig" else _read_take(path, target, fps)


def read_take_file(path: Path, target: str | None = None, fps: float | None = None) -> Take:
    """Read a take from any format; see `read_any`.

    Raises
    ------
    InputError
        Also when the file holds a rig.
    """
    found = read_any(path, target=target, fps=fps, kind="take")
    if isinstance(found, Rig):
        raise InputError("file", "a take", "a rig", "Give a performance.", where=str(path))
    return found


def targets_of(path: Path) -> dict[str, tuple[str, ...]]:
    """The targets of a take among which ``--target`` chooses, and the controls of each.

    Empty where there is nothing to choose.
    """
    path = Path(path)
    if path.suffix.lower() != ".npz" or not path.is_file() or npz.holds_rig(path):
        return {}
    targets = npz.read_targets(path)
    return targets if len(targets) > 1 else {}


def targets_for(target: str | None, *paths: Path | None) -> list[str | None]:
    """What ``--target`` says of several takes: it is for those that can have several targets.

    Where none can, it is for all of them, so that reading the first refuses it.
    """
    able = [path is not None and Path(path).suffix.lower() in _WITH_TARGETS for path in paths]
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
        target = next(fitting, npz.NO_TARGET)
        told = f"the model's is {target}" if target else "none is read"
        log.info("%s has several targets (%s): %s", Path(path).name, ", ".join(targets), told)
    return read_take_file(path, target)


def read_rig_file(path: Path, shapes: str | None = None) -> Rig:
    """Read a rig from any format; see `read_any`.

    Raises
    ------
    InputError
        Also when the file holds a take.
    """
    found = read_any(path, shapes=shapes, kind="rig")
    if isinstance(found, Take):
        raise InputError("file", "a rig", "a take", "Give a rig.", where=str(path))
    return found


def write_take_file(take: Take, path: Path, overwrite: bool = False) -> None:
    """Write a take in the format that the name's ending asks for.

    Raises
    ------
    InputError
        For an ending that cannot be written, or a take that the format cannot hold.
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    path = Path(path)
    require_take_output(path, overwrite)
    if path.suffix.lower() in HDF5_ENDINGS:
        write_take(take, path, overwrite)
        return
    _tell_what_is_lost(take, path)
    if path.name.lower().endswith(".livelink.csv"):
        write_livelink(take, path, overwrite)
    elif path.suffix.lower() == ".csv":
        write_table(take, path, overwrite)
    else:
        write_curves(take, path, overwrite)


def ends_in(path: Path, endings: tuple[str, ...]) -> bool:
    """Whether a file's name has one of the endings, and something before it."""
    return bool(path.suffix) and path.name.lower().endswith(endings)


def require_take_output(path: Path, overwrite: bool) -> None:
    """Refuse a name that no take can be written to, before any work is done.

    Raises
    ------
    InputError
        For an ending that cannot be written.
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    if not ends_in(path, TAKE_OUTPUTS):
        raise unknown_output(path, ", ".join(TAKE_OUTPUTS))
    if path.exists() and not overwrite:
        raise OutputExistsError(path)


def _tell_what_is_lost(take: Take, path: Path) -> None:
    """Warn of a file of poses alone that is to hold a few: read again, it would be a source."""
    if not 0 < len(take.labels) < len(take):
        return
    back = f"facert convert RECORDING OUT.h5 --poses {path.name} brings both together"
    if path.name.lower().endswith(".livelink.csv"):  # the rest of its rows are dropped when read
        back = "only a .csv, .json or .h5 tells of which frames"
    poses = plural(len(take.labels), "pose")
    log.warning("%s holds %s and not what was recorded: %s", path.name, poses, back)


def write_rig_file(rig: Rig, path: Path, overwrite: bool = False) -> None:
    """Write a rig; HDF5 is the only format for it here, see `facert.io.glb` for another.

    Raises
    ------
    InputError
        For another ending.
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    path = Path(path)
    if path.suffix.lower() not in HDF5_ENDINGS:
        raise unknown_output(path, ".h5 or .hdf5 for a rig")
    write_rig(rig, path, overwrite)


def _holds_rig(path: Path) -> bool:
    """Tell a rig from a take, for whatever can be read."""
    if path.is_dir():
        return True
    existing_file(path)
    ending = path.suffix.lower()
    if ending in HDF5_ENDINGS:
        with open_guarded(path) as file:
            return file.text_attribute("format") == RIG_FORMAT
    if ending == ".npz":
        return npz.holds_rig(path)
    return ending in GLTF_ENDINGS


def _read_take(path: Path, target: str | None, fps: float | None) -> Take:
    readers: dict[str, Callable[[], Take]] = {
        ".h5": lambda: read_take(path),
        ".hdf5": lambda: read_take(path),
        ".csv": lambda: _read_csv_take(path, fps),
        ".json": lambda: read_curves(path, fps),
        ".txt": lambda: read_facecap(path),
        ".c3d": lambda: read_c3d(path),
        ".trc": lambda: read_trc(path),
        ".glb": lambda: read_gltf_take(path, target),
        ".gltf": lambda: read_gltf_take(path, target),
        ".npz": lambda: npz.read_npz_take(path, target, fps),
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise _unknown_input(path)
    if target and path.suffix.lower() not in _WITH_TARGETS:
        able, fix = "an .npz take or a .glb animation", "Leave it out: there is nothing to choose."
        raise InputError("--target", able, f"a {path.suffix} take", fix, where=str(path))
    return reader()


def _read_rig(path: Path, shapes: str | None) -> Rig:
    ending = path.suffix.lower()
    if path.is_dir():
        return read_obj_folder(path)
    if ending in HDF5_ENDINGS:
        return read_rig(path)
    if ending in GLTF_ENDINGS:
        return read_gltf_rig(path)
    return npz.read_npz_rig(path, shapes)


def _read_csv_take(path: Path, fps: float | None) -> Take:
    with reading(path):
        livelink = is_livelink(read_header(path))
    return read_livelink(path) if livelink else read_table(path, fps)


def _unknown_input(path: Path) -> InputError:
    known = f"{', '.join(TAKE_ENDINGS)}, or a folder of .obj files"
    advice = _ADVICE.get(path.suffix.lower(), "Export it in one of these formats.")
    return InputError("kind of file", known, _ending(path), advice, where=str(path))


def unknown_output(path: Path, known: str) -> InputError:
    """What to say of an output whose ending is not among the known ones."""
    fix = "Choose a name for the output that ends so."
    return InputError("output's ending", known, _ending(path), fix, where=str(path))


def _ending(path: Path) -> str:
    return repr(path.suffix) if path.suffix else "no ending"
