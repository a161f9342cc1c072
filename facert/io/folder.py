"""The takes in a folder, among notes, poses, rigs, hidden files and whatever else lies there."""

from __future__ import annotations

import csv
import logging
import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from facert.data.column_names import Role, role_of_name
from facert.data.text import listed
from facert.io.gltf.document import open_gltf
from facert.io.guarded import encoding_of, files_in, read_beginning
from facert.io.hdf5 import TAKE_FORMAT, stated_format
from facert.io.lines import separator_of
from facert.io.live_recording import ENDING
from facert.io.npz import kind_of as kind_of_archive
from facert.io.registry import OWN_ENDINGS, format_of
from facert.io.tables.csv_table import CURVE
from facert.io.tables.table import is_number

log = logging.getLogger("facert")

ROWS = 200
"""Rows of a table that are looked at."""
_GLTF = (".glb", ".gltf", ".vrm", ".vrma")
_FACE_CAP = (b"info,", b"bs,", b"k,")
_LETTERS = re.compile(r"[^\W\d_]{2}")
_DOCUMENTS = (b'"settings"', b'"verdicts"')  # of an evaluation, of a batch


def takes_in(folder: Path) -> list[Path]:
    """The files in a folder that are takes, by name; the log names all that are not.

    One that is damaged is among them, or that cannot be looked into: who reads it says what is
    wrong.
    """
    takes: list[Path] = []
    others: list[Path] = []
    likely = set(files_in(folder))
    for path in sorted(path for path in folder.iterdir() if path.is_file()):
        (takes if path in likely and _is_take(path) else others).append(path)
    if others:
        names = listed([path.name for path in others], len(others))
        log.info("%s: passed over, as they are no takes: %s", folder.name, names)
    return takes


def _is_take(path: Path) -> bool:
    """Whether a file may be a take, by its name and a look into it."""
    found = format_of(path, "read", "take")
    if found is None or path.name.endswith(ENDING):  # a session records, or was killed
        return False
    try:
        return not _is_other(path, found.endings)
    except Exception:  # whatever a file holds, no look at it ends a batch
        return True


def _is_other(path: Path, endings: tuple[str, ...]) -> bool:
    """Whether a file of a format that takes come in is known to be something else."""
    if OWN_ENDINGS[0] in endings:
        return stated_format(path) not in ("", TAKE_FORMAT)
    if ".npz" in endings:
        return kind_of_archive(path) != "take"
    if set(endings) & set(_GLTF):
        with open_gltf(path) as document:
            return not document.root.get("animations")
    if ".txt" in endings:
        beginning = read_beginning(path).removeprefix(b"\xef\xbb\xbf").lstrip()
        return not beginning.startswith(_FACE_CAP)
    if ".json" in endings:
        beginning = read_beginning(path).lstrip()
        return beginning[:1] == b"{" and any(key in beginning[:200] for key in _DOCUMENTS)
    return ".csv" in endings and _is_no_recording(path)


def _is_no_recording(path: Path) -> bool:
    """Whether a table is the curve of a training, poses of numbered frames far apart, or a list."""
    with path.open(encoding=encoding_of(path), errors="replace", newline="") as file:
        lines = [line for _, line in zip(range(ROWS), file, strict=False)]
    header = lines[0] if lines else ""
    if header.strip() == CURVE:
        return True
    names, *rows = csv.reader(lines, delimiter=separator_of(header))
    return _is_list(names, rows) or _is_of_poses(names, rows)


def _is_list(names: Sequence[str], rows: Sequence[Sequence[str]]) -> bool:
    """Whether a table is of words, such as a list of shots: each row has some.

    Beside a clock or frame numbers they may be a recording's, with a name or a state in each row,
    unless there is no number at all.
    """
    if not rows or not all(any(map(_is_word, row)) for row in rows):
        return False
    timed = any(role_of_name(name) in (Role.CLOCK, Role.FRAME) for name in names)
    return not timed or not any(is_number(cell) for row in rows for cell in row)


def _is_word(cell: str) -> bool:
    return _LETTERS.search(cell) is not None and not is_number(cell)


def _is_of_poses(names: Sequence[str], rows: Sequence[Sequence[str]]) -> bool:
    """Whether a table has numbered frames, far apart, and no times."""
    places = [i for i, name in enumerate(names) if role_of_name(name) is Role.FRAME]
    if not places or any(name.strip().lower() == "time" for name in names):
        return False
    numbers = [int(row[places[0]]) for row in rows[:-1] if row[places[0]].strip().isdecimal()]
    steps = {after - before for before, after in pairwise(numbers)}
    return len(steps) > 1 and sorted(steps)[len(steps) // 2] > 1
