"""A mesh at rest from a file of any kind: OBJ, PLY, glTF, or the rest pose of a rig."""

from __future__ import annotations

from pathlib import Path

from facert.data.rig import Mesh
from facert.errors import reading
from facert.io.formats import GLTF_ENDINGS, read_rig_file
from facert.io.gltf_rig import read_gltf_mesh
from facert.io.obj import read_obj
from facert.io.ply import read_ply


def read_mesh(path: Path, shapes: str | None = None) -> Mesh:
    """Read a mesh: ``.obj``, ``.ply``, ``.glb``, or a rig at rest (``.h5``, ``.npz``, a folder).

    The vertices keep the file's order; quads and polygons become triangle fans.

    Parameters
    ----------
    path : Path
    shapes : str, optional
        Which set of shapes of an .npz rig that holds several.

    Raises
    ------
    InputError
        For an unknown ending, or a file that is not what its ending says.
    """
    path = Path(path)
    ending = path.suffix.lower() if not path.is_dir() else ""
    if ending == ".ply":
        return read_ply(path)
    if ending in GLTF_ENDINGS:
        return read_gltf_mesh(path)
    if ending == ".obj":
        with reading(path):
            return Mesh(*read_obj(path))
    return read_rig_file(path, shapes).mesh
