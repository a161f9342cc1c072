"""Scripts that bring facert's curves into other programs: one file each, without facert."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files
from pprint import pformat
from typing import Any

PROGRAMS = ("blender", "maya")
ADDONS = ("blender",)
MARK = "# facert export-script"

_FUTURE = "from __future__ import annotations\n"
_SHARED = re.compile(r"^from facert\.io\.importers\.(\w+) import (?:\([^)]*\)|[^(\n]+)\n", re.M)
_DRIVERS = re.compile(r"^(DRIVERS: .* =) \{\}", re.M)


def script(program: str, addon: bool = False, drivers: Mapping[str, Any] | None = None) -> str:
    """The script for one of `PROGRAMS`, or the add-on for one of `ADDONS`, with all that it needs.

    It is this package's module for the program, with the text of its neighbours in the place of
    their imports, and the tables of drivers where they are given.
    """
    text = _whole(f"{program}_addon" if addon else program, set())
    if drivers:
        held = pformat(dict(drivers), sort_dicts=False, width=100)
        text = _DRIVERS.sub(lambda found: f"{found[1]} {held}", text, count=1)
    return f"{text}\n{MARK}\n"


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
