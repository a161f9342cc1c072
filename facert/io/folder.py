"""The takes in a folder, among notes, poses, rigs, hidden files and whatever else lies there."""

from __future__ import annotations

import csv
import logging
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

from facert.data.column_names import Role, role_of_name
from facert.data.text import listed
from facert.errors import FacertError
from facert.io.gltf.document import open_gltf
from facert.io.guarded import encoding_of, read_beginning
from facert.io.hdf5 import TAKE_FORMAT, stated_format
from facert.io.lines import separator_of
from facert.io.npz import kind_of as kind_of_archive
from facert.io.registry import OWN_ENDINGS, format_of
from facert.io.tables.csv_table import CURVE

log = logging.getLogger("facert")

ROWS = 200
"""Rows of a table that are looked at."""
_GLTF = (".glb", ".gltf", ".vrm", ".vrma")
_FACE_CAP = (b"info,", b"bs,", b"k,")
_DOCUMENTS = (b'"settings"', b'"verdicts"')  # of an evaluation, of a batch


def takes_in(folder: Path) -> list[Path]:
    """The files in a folder that are takes, by name; the log names those that are not.

    One that is damaged is among them: who reads it says what is wrong.
    """
    takes: list[Path] = []
    others: list[Path] = []
    for path in sorted(path for path in folder.iterdir() if path.is_file()):
        (takes if _is_take(path) else others).append(path)
    if others:
        names = listed([path.name for path in others])
        log.info("%s: passed over, as they are no takes: %s", folder.name, names)
    return takes


def _is_take(path: Path) -> bool:
    """Whether a file may be a take, by its name and a look into it."""
    if path.name.startswith(".") or path.name.endswith("~"):
        return False  # of the system, of a copy that goes on, of an editor
    found = format_of(path, "read", "take")
    if found is None:
        return False
    with suppress(FacertError, OSError, UnicodeError, csv.Error):
        return not _is_other(path, found.endings)
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
    """Whether a table is the curve of a training, or of poses: numbered frames, far apart."""
    with path.open(encoding=encoding_of(path), errors="replace", newline="") as file:
        lines = [line for _, line in zip(range(ROWS), file, strict=False)]
    header = lines[0] if lines else ""
    if header.strip() == CURVE:
        return True
    rows = list(csv.reader(lines, delimiter=separator_of(header)))
    places = [i for i, name in enumerate(rows[0]) if role_of_name(name) is Role.FRAME]
    if not places or any(name.strip().lower() == "time" for name in rows[0]):
        return False
    numbers = [int(row[places[0]]) for row in rows[1:-1] if row[places[0]].strip().isdecimal()]
    steps = {after - before for before, after in pairwise(numbers)}
    return len(steps) > 1 and sorted(steps)[len(steps) // 2] > 1
