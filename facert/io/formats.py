"""The one table of file formats for takes and rigs: what a name's ending means.

Meshes at rest and in motion have rooms of their own: `mesh`, `mesh_sequence`, `glb`.

=================  =================================  ==========================================
ending             read                               written
=================  =================================  ==========================================
``.h5 .hdf5``      take or rig, by its ``format``     take or rig, with all that it holds
``.livelink.csv``  Live Link Face CSV                 poses, else source weights, of ARKit names
``.csv``           Live Link Face CSV when the        poses, else the source, as a plain table
                   header says so; else a table
``.npz``           take or rig, by its keys           -
a folder           OBJ files: a rig                   -
=================  =================================  ==========================================
"""

from __future__ import annotations

from pathlib import Path

from facert.data import Rig, Take
from facert.errors import InputError, reading
from facert.io import npz
from facert.io.hdf5 import open_guarded
from facert.io.livelink import is_livelink, read_livelink, write_livelink
from facert.io.obj import read_obj_folder
from facert.io.rig import FORMAT as RIG_FORMAT
from facert.io.rig import read_rig, write_rig
from facert.io.table import read_table, write_table
from facert.io.take import read_take, write_take
from facert.io.text import existing_file, read_header

HDF5_ENDINGS = (".h5", ".hdf5")


def read_any(
    path: Path, target: str | None = None, shapes: str | None = None, fps: float | None = None
) -> Take | Rig:
    """Read a take or a rig from any format.

    Parameters
    ----------
    path : Path
    target, shapes : str, optional
        Which target, or set of shapes, of an .npz file that holds several.
    fps : float, optional
        Frames a second of a file that does not say.

    Raises
    ------
    InputError
        For an unknown ending, or a file that is not what its ending says.
    """
    path = Path(path)
    if path.is_dir():
        return read_obj_folder(path)
    existing_file(path)
    ending = path.suffix.lower()
    if ending in HDF5_ENDINGS:
        return read_rig(path) if _hdf5_format(path) == RIG_FORMAT else read_take(path)
    if ending == ".npz" and npz.holds_rig(path):
        return npz.read_npz_rig(path, shapes)
    if ending == ".npz":
        return npz.read_npz_take(path, target, fps)
    if ending == ".csv":
        return _read_csv_take(path, fps)
    raise _unknown_ending(path, ".h5, .hdf5, .csv, .npz, or a folder of .obj files")


def read_take_file(path: Path, target: str | None = None, fps: float | None = None) -> Take:
    """Read a take from any format; see `read_any`.

    Raises
    ------
    InputError
        Also when the file holds a rig.
    """
    found = read_any(path, target=target, fps=fps)
    if isinstance(found, Rig):
        raise InputError("file", "a take", "a rig", "Give a performance.", where=str(path))
    return found


def read_rig_file(path: Path, shapes: str | None = None) -> Rig:
    """Read a rig from any format; see `read_any`.

    Raises
    ------
    InputError
        Also when the file holds a take.
    """
    found = read_any(path, shapes=shapes)
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
    ending = path.suffix.lower()
    if ending in HDF5_ENDINGS:
        write_take(take, path, overwrite)
    elif path.name.lower().endswith(".livelink.csv"):
        write_livelink(take, path, overwrite)
    elif ending == ".csv":
        write_table(take, path, overwrite)
    else:
        raise _unknown_ending(path, ".h5, .hdf5, .livelink.csv or .csv")


def write_rig_file(rig: Rig, path: Path, overwrite: bool = False) -> None:
    """Write a rig; HDF5 is the only format for it.

    Raises
    ------
    InputError
        For another ending.
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    path = Path(path)
    if path.suffix.lower() not in HDF5_ENDINGS:
        raise _unknown_ending(path, ".h5 or .hdf5 for a rig")
    write_rig(rig, path, overwrite)


def _hdf5_format(path: Path) -> str:
    with open_guarded(path) as file:
        return file.text_attribute("format")


def _read_csv_take(path: Path, fps: float | None) -> Take:
    with reading(path):
        livelink = is_livelink(read_header(path))
    return read_livelink(path) if livelink else read_table(path, fps)


def _unknown_ending(path: Path, known: str) -> InputError:
    ending = repr(path.suffix) if path.suffix else "none"
    return InputError("file name's ending", known, ending, "Rename the file.", where=str(path))
