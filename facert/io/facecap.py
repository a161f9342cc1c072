"""Face Cap recordings (TXT): tracked weights of an iPhone.

Lines of cells between commas, each with a word in front: ``info`` is of the program, ``bs`` names
the shapes, ``k`` is a frame: milliseconds, the head's position and rotation (3 + 3), the rotations
of the eyes (2 + 2), then a weight a shape.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from facert.data.clock import put_together
from facert.data.names import canonical
from facert.data.rate import nominal_rate
from facert.data.take import Source, Take
from facert.errors import InputError, reading
from facert.io.lines import Line, check_width, read_lines, to_numbers, without_cut_end

log = logging.getLogger("facert")

_CLOCK = 1  # of a frame's cells
_SHAPES = 12  # from here on


def read_facecap(path: Path) -> Take:
    """Read a Face Cap recording as a take whose source is weights, in ARKit's spelling.

    Time counts from the first frame. The motion of head and eyes is left out: it has no shapes.

    Raises `InputError` naming the file and the line that is at fault.
    """
    with reading(path):
        lines = read_lines(path, ",")
        names = _shape_names(lines)
        rows = _without_trailing_comma([row for row in lines if row.cells[0] == "k"])
        if not rows:
            raise InputError("file", "lines of frames (k,...)", "none", "Export it again.")
        rows = without_cut_end(rows)
        header = ["k", "milliseconds", *(f"pose {i}" for i in range(1, 11)), *names]
        check_width(rows, header)
        columns = [_CLOCK, *range(_SHAPES, len(header))]
        values = to_numbers(rows, header, columns)
        for row in np.flatnonzero(~np.isfinite(values[:, 0])):
            raise rows[row].error("milliseconds", "a number", repr(rows[row].cells[_CLOCK][:40]))
        time = put_together((values[:, 0] - values[0, 0]) / 1000.0, values[:, 1:])
        log.info("the motion of head and eyes is left out")
        return Take(
            time=time,
            source=Source(values[:, 1:], tuple(map(canonical, names))),
            fps=nominal_rate(time),
        )


def _shape_names(lines: Sequence[Line]) -> list[str]:
    named = [row.cells[1:] for row in lines if row.cells[0] == "bs"]
    if not named:
        expected, found = "a Face Cap recording", "no line that begins with 'bs,'"
        raise InputError("file", expected, found, "Give a Face Cap TXT.")
    if len(named) > 1:
        expected = "one line with the shapes' names"
        raise InputError("lines bs", expected, f"{len(named)}", "Export it again.")
    return named[0] if named[0] and named[0][-1] else named[0][:-1]


def _without_trailing_comma(rows: Sequence[Line]) -> list[Line]:
    return [Line(row.number, row.cells[:-1] if not row.cells[-1] else row.cells) for row in rows]
