"""Headers of several lines, as Vicon Nexus and OptiTrack Motive write them above trajectories.

The last line has ``X,Y,Z`` for each marker behind its columns of frames and times; a line above has
the markers' names, once or three times each. Vicon states rate and unit in lines of their own,
Motive in its first line; pandas names the columns in front above, or in a line of its own below.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from facert.io.lines import Line

_AXES = ("x", "y", "z")
_LONGEST = 16  # lines
_UNITS = {"millimeters": "mm", "centimeters": "cm", "meters": "m", "inches": "in", "feet": "ft"}
_KNOWN = frozenset((*_UNITS.values(), "dm"))
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class MarkerHeader:
    """What the lines above trajectories state."""

    names: tuple[str, ...]
    """A name a column: those in front as they are, then ``NAME.x NAME.y NAME.z``."""
    body: list[Line]
    """The lines below."""
    rate: float | None
    unit: str


def marker_header(lines: Sequence[Line]) -> MarkerHeader | None:
    """The header of trajectories among the first lines of a table, if it has one."""
    for index, line in enumerate(lines[1:_LONGEST], start=1):
        cells = [cell.strip().lower() for cell in line.cells]
        front = next((i for i, cell in enumerate(cells) if cell in _AXES), 0)
        axes = _without_blanks(cells[front:])
        if front and axes and axes == [*_AXES] * (len(axes) // 3):
            return _below(lines, index, front, len(axes))
    return None


def _below(lines: Sequence[Line], index: int, front: int, width: int) -> MarkerHeader | None:
    above = [[cell.strip() for cell in line.cells] for line in lines[:index]]
    markers = _marker_names(above, front, width)
    if markers is None:
        return None
    after = [cell.strip() for cell in lines[index + 1].cells] if index + 1 < len(lines) else []
    stated = {cell.lower() for cell in after[front:]} - {""}
    has_units = len(stated) == 1 and stated <= _KNOWN
    below = after[:front] if not stated and _is_text(after[:front]) else []
    first = index + 1 + (has_units or bool(below))
    leading = [cell.strip() for cell in lines[index].cells[:front]]
    end = front + width
    body = [Line(line.number, _filled(line.cells, end)) for line in lines[first:]]
    return MarkerHeader(
        names=_leading([below, leading, *reversed(above)], front)
        + tuple(f"{name}.{axis}" for name in markers for axis in _AXES),
        body=body,
        rate=_rate(above),
        unit=stated.pop() if has_units else _unit(above),
    )


def _marker_names(above: Sequence[Sequence[str]], front: int, width: int) -> list[str] | None:
    """The names over the columns: of the line nearest that has another one for each marker."""
    for cells in reversed(above):
        threes = [cells[i : i + 3] for i in range(front, front + width, 3)]
        names = [next(filter(None, three), "") for three in threes]
        alone = all(set(three) <= {name, ""} for three, name in zip(threes, names, strict=True))
        of_ids = front > 1 and len(cells) > 1 and cells[front - 1].lower() in ("id", "type")
        if alone and all(names) and len(set(names)) == len(names) and not of_ids:
            return names
    return None


def _leading(lines: Sequence[Sequence[str]], front: int) -> tuple[str, ...]:
    """The names of the columns in front: each of the first of these lines that has one."""
    columns = itertools.islice(itertools.zip_longest(*lines, fillvalue=""), front)
    return tuple(next(filter(None, cells), "") for cells in columns)


def _is_text(cells: Sequence[str]) -> bool:
    """Whether some cells are filled, and none is a number."""
    return any(cells) and not any(map(_NUMBER.fullmatch, cells))


def _filled(cells: Sequence[str], width: int) -> list[str]:
    """So many cells: trailing ones are blank where a line is short, or cut where they are."""
    return [*cells, *[""] * (width - len(cells))][:width]


def _without_blanks(cells: Sequence[str]) -> list[str]:
    end = max((i + 1 for i, cell in enumerate(cells) if cell), default=0)
    return list(cells[:end])


def _rate(above: Sequence[Sequence[str]]) -> float | None:
    """The rate: a number alone in a line, or behind words for it."""
    for cells in above:
        filled = [cell for cell in cells if cell]
        if len(filled) == 1 and _NUMBER.fullmatch(filled[0]):
            return float(filled[0]) or None
        for name, value in itertools.pairwise(cells):
            if "frame rate" in name.lower() and _NUMBER.fullmatch(value):
                return float(value) or None
    return None


def _unit(above: Sequence[Sequence[str]]) -> str:
    words = (cell.lower() for cells in above for cell in cells)
    return next((_UNITS[word] for word in words if word in _UNITS), "")
