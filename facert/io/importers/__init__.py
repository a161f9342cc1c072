"""Scripts that bring facert's curves into other programs: one file each, without facert."""

from __future__ import annotations

from importlib.resources import files

PROGRAMS = ("blender", "maya")

_FUTURE = "from __future__ import annotations\n"
_SHARED = "from facert.io.importers.shared import"


def script(program: str) -> str:
    """The script for one of `PROGRAMS`, with all that it needs in it.

    It is this package's module for the program, with the text of `facert.io.importers.shared` in
    the place of its import.
    """
    folder = files(__name__)
    own = (folder / f"{program}.py").read_text(encoding="utf-8").splitlines(keepends=True)
    _, shared = (folder / "shared.py").read_text(encoding="utf-8").split(_FUTURE, 1)
    return "".join(f"\n{shared.strip()}\n" if line.startswith(_SHARED) else line for line in own)
