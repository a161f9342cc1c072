"""Recordings that go on: what `live` records, row by row, until its end makes a take of it.

A line of JSON with what is the same in all frames, then a row of float64 a frame: its second, the
pose and its standard deviation (where there are controls), and the source. A row is in the system's
hands once it is added; so the death of the session takes no frame, and a reader passes over a row
that was cut off.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.memory import FileMemory
from facert.data.rate import nominal_rate
from facert.data.take import Controls, Source, Take
from facert.data.version import CREATED_BY, MARK
from facert.errors import InputError, reading
from facert.io.atomic import Appended, write_bytes
from facert.io.guarded import existing_file, parsing, read_beginning

ENDING = ".recording"
FORMAT, VERSION = "facert-recording", 1


class LiveRecording:
    """A file of frames that grows; it begins empty.

    Parameters
    ----------
    path : Path
        A file there is replaced.
    like : Take
        A take with the names, units and controls of the recording, whatever its frames.
    start_timecode : callable
        Asked with the first frame for its timecode.

    Raises
    ------
    InputError
        When nothing can be written there.
    """

    def __init__(self, path: Path, like: Take, start_timecode: Callable[[], str]) -> None:
        self.path = path
        self._like, self._start_timecode = like, start_timecode
        self.count = 0
        write_bytes(b"", path, overwrite=True)
        self._file = Appended(path)

    def add(self, row: FloatArray) -> None:
        """Append the row of a frame.

        Raises `InputError` when there is no room for it; then the file ends with the row before.
        """
        head = (
            b"" if self.count else _head(replace(self._like, start_timecode=self._start_timecode()))
        )
        self._file.add(head + np.asarray(row, dtype="<f8").tobytes())
        self.count += 1

    def close(self) -> None:
        """Close the file, which stays."""
        self._file.close()

    def take(self) -> Take:
        """All frames as a take; there must be one."""
        return _read(self._file.content())

    def remove(self) -> None:
        """Delete the file: the take is written, or there is none."""
        self.close()
        self.path.unlink(missing_ok=True)


def recording_of(path: Path) -> Path:
    """The recording that goes on while a take is made, beside it."""
    return path.with_name(f"{path.name}{ENDING}")


def read_recording(path: Path) -> Take:
    """Read a recording whose session was killed, or goes on, as a take.

    Raises `InputError` when it holds no frame, or is damaged.
    """
    with reading(path):
        existing_file(path)
        FileMemory(path).require(4 * path.stat().st_size, "file")
        return _read(path.read_bytes())


def bears_mark(path: Path) -> bool:
    """Whether facert wrote a file of this kind."""
    beginning = read_beginning(path)
    return beginning.startswith(f'{{"format": "{FORMAT}", '.encode()) and MARK.encode() in beginning


def _head(like: Take) -> bytes:
    """The first line: all that a take has beside its frames."""
    controls = like.controls
    facts = {
        "format": FORMAT,
        "format_version": VERSION,
        "created_by": CREATED_BY,
        "kind": like.source.kind,
        "names": like.source.names,
        "controls": None if controls is None else controls.names,
        "limits": None if controls is None or controls.limits is None else controls.limits.tolist(),
        "units": like.units,
        "start_timecode": like.start_timecode,
    }
    return json.dumps(facts).encode() + b"\n"


def _read(content: bytes) -> Take:
    with parsing("line 1", "what the recording is"):
        begin = content.find(b"\n") + 1
        facts = _facts(content[:begin])
        names, controls = tuple(facts["names"]), _controls(facts)
        texts = [facts["units"], facts["start_timecode"], *names, *(facts["controls"] or ())]
        if not all(isinstance(text, str) for text in texts):
            raise ValueError("a number where a text is due")
        size = len(names) * (3 if facts["kind"] == "markers" else 1)
        width = 1 + 2 * (0 if controls is None else len(controls.names)) + size
        count = (len(content) - begin) // (8 * width)
        values = np.frombuffer(content, "<f8", count * width, begin)
        return _take(values.reshape(-1, width), names, controls, facts)


def _facts(line: bytes) -> dict[str, Any]:
    facts = json.loads(line or b"{}")
    if not isinstance(facts, dict) or facts.get("format") != FORMAT:
        found, fix = "no frame" if not line else "something else", "Give another file."
        raise InputError("file", "a recording of facert live", found, fix)
    if facts["format_version"] != VERSION:
        found, fix = repr(facts["format_version"]), "Update facert."
        raise InputError("format_version", str(VERSION), found, fix)
    return facts


def _controls(facts: dict[str, Any]) -> Controls | None:
    if facts["controls"] is None:
        return None
    limits = facts["limits"]
    return Controls(tuple(facts["controls"]), None if limits is None else np.array(limits, float))


def _take(
    table: FloatArray, names: tuple[str, ...], controls: Controls | None, facts: dict[str, Any]
) -> Take:
    """The take of a recording's rows (T, width)."""
    if not len(table):
        raise InputError("file", "a whole frame", "none", "There is nothing to recover.")
    posed = 0 if controls is None else len(controls.names)
    time, params, std, values = np.split(table, [1, 1 + posed, 1 + 2 * posed], axis=1)
    seconds = time[:, 0] - time[0, 0]
    shape = (len(table), -1, 3) if facts["kind"] == "markers" else (len(table), -1)
    seen = np.where(np.isinf(values), np.nan, values)
    return Take(
        time=seconds,
        source=Source(seen.reshape(shape), names),
        controls=controls,
        params=params if posed else None,
        std=None if np.isnan(std).all() else std,
        fps=nominal_rate(seconds),
        units=facts["units"],
        start_timecode=facts["start_timecode"],
    )
