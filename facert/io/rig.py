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
from facert.io.hdf5 import create, open_guarded

FORMAT = "facert-rig"
VERSION = 1


def read_rig(path: Path) -> Rig:
    """Read a rig file.

    Raises
    ------
    InputError
        Naming the file and the HDF5 path that is at fault.
    """
    with open_guarded(path) as file:
        file.require_format(FORMAT, VERSION)
        return Rig(
            neutral=file.numbers("/neutral"),
            shapes=file.numbers("/shapes"),
            names=file.names("/names"),
            faces=file.integers("/faces"),
            units=file.text_attribute("units"),
            colours=file.numbers("/colours") if "/colours" in file else None,
        )


def write_rig(rig: Rig, path: Path, overwrite: bool = False) -> None:
    """Write a rig file; the same rig gives the same bytes.

    Raises
    ------
    OutputExistsError
        When `path` exists and `overwrite` is not set.
    """
    with create(path, FORMAT, VERSION, overwrite) as file:
        file.attribute("units", rig.units)
        file.array("/neutral", rig.neutral)
        file.array("/shapes", rig.shapes)
        file.names("/names", rig.names)
        file.array("/faces", rig.faces)
        if rig.colours is not None:
            file.array("/colours", rig.colours)
