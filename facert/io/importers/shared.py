"""Functions shared by scripts that run inside of other programs, so that this needs no package."""

from __future__ import annotations

import csv
import json
import re
import unicodedata
from collections.abc import Iterable
from typing import NamedTuple


class Curves(NamedTuple):
    """Values over time.

    ``time`` has seconds; ``values`` has, for each name, as many numbers, None where not known.
    """

    fps: float
    time: list[float]
    values: dict[str, list[float | None]]


class Key(NamedTuple):
    """A value at a time in seconds."""

    time: float
    value: float


def read_curves(path: str) -> Curves:
    """Read a .json or .csv that facert wrote."""
    read = _read_json if path.lower().endswith(".json") else _read_csv
    return read(path)


def keys(curves: Curves, name: str) -> list[Key]:
    """The known values of a curve; of one that never changes only the first."""
    known = [
        Key(time, value)
        for time, value in zip(curves.time, curves.values[name])
        if value is not None
    ]
    constant = all(key.value == known[0].value for key in known)
    return known[:1] if constant else known


def spelling(name: str) -> str:
    """Common spelling of ``eyeBlink_L``, ``EyeBlinkLeft`` and ``eye-blink.left``."""
    name = re.sub(r"(?<=[a-z0-9])[LR]$|[._-][lLrR]$", _side, unicodedata.normalize("NFKC", name))
    return re.sub(r"[\W_]", "", name.casefold())


def find(name: str, there: Iterable[str]) -> str | None:
    """The name among others that is spelled alike, if there is one."""
    there = list(there)
    if name in there:
        return name
    alike = [other for other in there if spelling(other) == spelling(name)]
    return alike[0] if len(alike) == 1 else None


def _side(found: re.Match[str]) -> str:
    return "left" if found.group().lower().endswith("l") else "right"


def _read_json(path: str) -> Curves:
    with open(path, encoding="utf-8") as file:
        document = json.load(file)
    rows, fps = document["weightMat"], float(document["exportFps"])
    time = document.get("time") or [row / fps for row in range(len(rows))]
    columns = zip(*rows)
    return Curves(fps, time, dict(zip(document["facsNames"], map(list, columns))))


def _read_csv(path: str) -> Curves:
    with open(path, encoding="utf-8-sig", newline="") as file:
        header, *rows = [row for row in csv.reader(file) if row]
    place = next(i for i, name in enumerate(header) if name.split(" (")[0] == "time")
    time = [float(row[place]) for row in rows]
    values = {
        name: [float(row[column]) if row[column] else None for row in rows]
        for column, name in enumerate(header)
        if column != place
    }
    steps = sorted(after - before for before, after in zip(time, time[1:]))
    return Curves(1 / steps[len(steps) // 2] if steps else 30.0, time, values)
