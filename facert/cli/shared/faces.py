"""How commands open the faces that they draw, from files of either kind."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from facert.data.rig import Rig
from facert.data.take import Take
from facert.errors import InputError, reading
from facert.io.formats import read_take_file
from facert.io.mesh_sequence import holds_mesh_sequence, open_mesh_sequence
from facert.render.faces import Face, posed_face


def open_face(
    stack: ExitStack, path: Path, rig: Rig | None, target: str | None, label: str = ""
) -> tuple[Face, Take | None]:
    """A mesh sequence, or a rig in the poses of a take; and the take.

    Parameters
    ----------
    stack : ExitStack
        Keeps the file open while its frames are fetched.
    path : Path
    rig : Rig, optional
        The character, for a take.
    target : str, optional
        Which target of an .npz take that holds several.
    label : str
        What to write beside the face; by default the file's name, or ``character`` for a take.

    Raises
    ------
    InputError
        When the file is neither, or a take comes without a rig.
    """
    if holds_mesh_sequence(path):
        return Face(label or path.stem, stack.enter_context(open_mesh_sequence(path))), None
    take = read_take_file(path, target)
    with reading(path):
        if rig is None:
            raise InputError("--rig", "the character's rig", "none", "Give it with --rig.")
        return posed_face(take, rig, label or "character"), take
