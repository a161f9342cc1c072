"""Rig files: facert's own HDF5 layout for a mesh with linear shapes.

============  ===========  ============================================
``/neutral``  (V, 3)       rest pose
``/shapes``   (P, V, 3)    displacement of every vertex at control = 1
``/names``    (P,)         UTF-8
``/faces``    (F, 3) int   triangles
``/colours``  (V, 3)       optional: red, green, blue, 0 to 1
attributes                 format, format_version, units, created_by
============  ===========  ============================================
"""

from __future__ import annotations

from pathlib import Path

from facert.data.rig import Rig
from facert.io.hdf5 import RIG_FORMAT, create, open_guarded

VERSION = 1


def read_rig(path: Path) -> Rig:
    """Read a rig file.

    Raises `InputError` naming the file and the HDF5 path that is at fault.
    """
    with open_guarded(path) as file:
        file.require_format(RIG_FORMAT, VERSION)
        mesh, shapes, names = file.mesh(), file.numbers("/shapes"), file.names("/names")
        return Rig(mesh.vertices, shapes, names, mesh.faces, mesh.units, mesh.colours)


def write_rig(rig: Rig, path: Path, overwrite: bool = False) -> None:
    """Write a rig file; the same rig gives the same bytes.

    Raises `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    with create(path, RIG_FORMAT, VERSION, overwrite) as file:
        file.mesh(rig.mesh)
        file.array("/shapes", rig.shapes)
        file.names("/names", rig.names)
