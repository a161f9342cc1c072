"""Scripts that bring facert's curves into other programs: one file each, without facert."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from pprint import pformat
from typing import Any

from facert.data.version import CREATED_BY, MARK
from facert.io.guarded import read_beginning

PROGRAMS = ("blender", "maya")
ADDONS = ("blender",)

_MARK = re.compile(rf'"""(?s:.*?)"""\n\n# {MARK}\S+ export-script\n'.encode())
_FUTURE = "from __future__ import annotations\n"
_SHARED = re.compile(r"^from facert\.io\.importers\.(\w+) import (?:\([^)]*\)|[^(\n]+)\n", re.M)
_DRIVERS = re.compile(r"^(DRIVERS: .* =) \{\}$", re.M)


def script(program: str, addon: bool = False, drivers: Mapping[str, Any] | None = None) -> str:
    """The script for one of `PROGRAMS`, or the add-on for one of `ADDONS`, with all that it needs.

    It is this package's module for the program, with the text of its neighbours in the place of
    their imports, and the tables of drivers where they are given.
    """
    text = _whole(f"{program}_addon" if addon else program, set())
    if drivers:
        held = pformat(dict(drivers), sort_dicts=False, width=100)
        text = _DRIVERS.sub(lambda found: f"{found[1]} {held}", text, count=1)
    return text.replace('"""\n\n', f'"""\n\n# {CREATED_BY} export-script\n', 1)


def bears_mark(path: Path) -> bool:
    """Whether a file is a script that `script` made."""
    return _MARK.match(read_beginning(path)) is not None


def _whole(module: str, there: set[str]) -> str:
    """A module's text with that of its neighbours, each once."""
    there.add(module)

    def neighbour(found: re.Match[str]) -> str:
        if found[1] in there:
            return ""
        _, body = _whole(found[1], there).split(_FUTURE, 1)
        return f"\n{body.strip()}\n\n"

    text = (files(__name__) / f"{module}.py").read_text(encoding="utf-8")
    return _SHARED.sub(neighbour, text)
