"""Regions in a TOML file: a table a region, with its markers and its controls.

[brows-and-eyes]
markers = ["browLeft", "browRight"]
controls = ["browInnerUp", "eyeBlinkLeft"]
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

from facert.data.regions import Regions
from facert.errors import reading
from facert.io.toml import read_toml

EXAMPLE = '[brows] with markers = ["M1", "M2"] and controls = ["browInnerUp"] below'
WIDTH = 100
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def read_regions(path: Path) -> Regions:
    """The regions in a file; whether they fit a take is for `Regions.matched` to tell.

    Raises
    ------
    InputError
        When the file is missing, too large, not TOML, or holds anything else.
    """
    with reading(path):
        return Regions.of(read_toml(path, EXAMPLE))


def regions_text(regions: Regions) -> str:
    """What `read_regions` reads, for a person to edit."""
    tables = [
        f"[{name if _BARE.fullmatch(name) else _quoted(name)}]\n"
        + "".join(f"{key} = [\n{_listed(names)}\n]\n" for key, names in table.items())
        for name, table in regions.tables.items()
    ]
    return "\n".join(tables)


def _listed(names: Sequence[str]) -> str:
    """Names in lines that fit a terminal; a space in a name is no place to break."""
    lines, line = [], "   "
    for name in map(_quoted, names):
        if len(line) + len(name) + 2 > WIDTH:
            lines.append(line)
            line = "   "
        line += f" {name},"
    return "\n".join([*lines, line])


def _quoted(name: str) -> str:
    """A basic string of TOML; JSON spells all but one sign as it does."""
    return json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")
