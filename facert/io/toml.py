"""TOML files that a person writes: any table; the regions of a face; drivers of nodes.

[brows-and-eyes]
markers = ["browLeft", "browRight"]
controls = ["browInnerUp", "eyeBlinkLeft"]

[[eyeLookInLeft]]
node = "eye_L"
rotate = [0, 25, 0]
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from facert.data.drivers import Drivers
from facert.data.regions import Regions
from facert.errors import InputError
from facert.io.guarded import door, read_text

REGIONS_EXAMPLE = '[brows] with markers = ["M1", "M2"] and controls = ["browInnerUp"] below'
DRIVERS_EXAMPLE = '[[eyeLookInLeft]] with node = "eye_L" and rotate = [0, 25, 0] below'
MAX_SIZE = 2**20
"""Most characters, of a file that a person writes: each table takes its time."""
WIDTH = 100
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_PARTS = 32
_LONG_KEY = re.compile(
    r"""(?<![\w-])(?:(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+)"""
    + f"{{{_PARTS}}}"
)
"""A key of more parts between dots than anybody writes; tomllib takes their square in time."""


def read_toml(path: Path, example: str = "name = value") -> dict[str, Any]:
    """The table in a TOML file; whoever takes it checks its names and values.

    Raises `InputError` with this example when the file is missing, too large, or not TOML.
    """
    with door(path):
        try:
            text = read_text(path)
            if len(text) > MAX_SIZE:
                raise ValueError(f"more than {MAX_SIZE} characters")
            if _LONG_KEY.search(text):
                raise ValueError(f"a key of more than {_PARTS} parts")
            return tomllib.loads(text)
        except (ValueError, RecursionError) as error:
            expected = f"TOML such as {example}"
            raise InputError("file", expected, f"{error}", "Correct the file.") from error


def read_regions(path: Path) -> Regions:
    """The regions in a file: a table a region; `Regions.matched` checks them against a take.

    Raises `InputError` when the file is missing, too large, not TOML, or holds anything else.
    """
    with door(path):
        return Regions.of(read_toml(path, REGIONS_EXAMPLE))


def read_drivers(path: Path) -> Drivers:
    """The drivers in a file: tables of a control, each with a node and how it moves.

    Raises `InputError` when the file is missing, too large, not TOML, or holds anything else.
    """
    with door(path):
        return Drivers.of(read_toml(path, DRIVERS_EXAMPLE))


def regions_text(regions: Regions) -> str:
    """TOML of regions, as `read_regions` reads it, for a person to edit."""
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
    """A name as a basic string of TOML, of which nothing upsets a terminal."""
    return '"' + "".join(map(_escaped, name)) + '"'


def _escaped(sign: str) -> str:
    if sign in '"\\':
        return f"\\{sign}"
    return sign if sign.isprintable() else f"\\U{ord(sign):08X}"
