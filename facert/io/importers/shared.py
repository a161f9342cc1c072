"""Functions shared by scripts that run inside of other programs, so that this needs no package."""

from __future__ import annotations

import csv
import difflib
import json
import math
import re
import unicodedata
from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

Read = TypeVar("Read")

CLOCKS = ("time", "seconds", "time_s")
MAX_RATE, MAX_SECONDS, MAX_FRAME = 1e4, 1e6, 10**7
"""Most of what a file may state; programs count frames in 32 bits."""
_FORMULA = re.compile(r"'*(?:\s*[=+\-@\uff1d\uff0b\uff0d\uff20]|[\t\r\n])")
"""Of a name: see `facert.data.text.for_csv`."""


class ScriptError(Exception):
    """What a user can mend; its text is the message."""


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


class Pose(NamedTuple):
    """The values of controls at a frame of a recording; seconds count from its first frame."""

    frame: int
    seconds: float
    values: dict[str, float]


class Timeline(NamedTuple):
    """Which frame of a recording is when.

    Of the frames whose seconds are known (frame and seconds, both rising) the nearest counts, and
    the rate from there.
    """

    rate: float
    known: Sequence[tuple[int, float]] = ((0, 0.0),)

    def frame(self, seconds: float) -> int | None:
        """The frame at a time, within half a frame; None where the recording has none."""
        place = self._nearest([when for _, when in self.known], seconds)
        frame, when = self.known[place]
        found = frame + math.floor((seconds - when) * self.rate + 0.5)
        before, after = self.known[max(0, place - 1)][0], self.known[place + 1 :][:1]
        counted = found == frame or (
            before < found or place == 0 if found < frame else not after or found < after[0][0]
        )
        return found if counted and found >= 0 else None

    def seconds(self, frame: int) -> float:
        """The time of a frame."""
        known, when = self.known[self._nearest([frame for frame, _ in self.known], frame)]
        return when + (frame - known) / self.rate

    def _nearest(self, values: list[Any], value: float) -> int:
        place = bisect_left(values, value)
        around = range(max(0, place - 1), min(len(values), place + 1))
        return min(around, key=lambda i: abs(values[i] - value))


def read_curves(path: str) -> Curves:
    """Read a .json or .csv that facert wrote.

    Raises `ScriptError` when the file is missing, or is none.
    """
    read = _read_json if path.lower().endswith(".json") else _read_csv
    return _reading(path, lambda path: _checked(read(path)))


def read_poses(path: str) -> list[tuple[int | None, float | None, dict[str, float]]]:
    """Frame, seconds and values of the poses in a table, by its column frame or one of seconds.

    Raises `ScriptError` when the file is missing, or is none.
    """
    if path.lower().endswith(".json"):
        curves = read_curves(path)
        frames: list[Any] = [None] * len(curves.time)
        return _poses(frames, list(curves.time), curves.values)
    return _reading(path, _read_pose_table)


def read_suggestions(path: str, take: str = "") -> list[tuple[int, float | None]]:
    """Frames, and their seconds where they are known, of ``facert suggest --json``, or of a list.

    Of suggestions for several takes those of one are read.

    Raises `ScriptError` when the file is missing, or is none, or does not have that take.
    """
    return _reading(path, lambda path: _read_suggestions(path, take))


def listed_frames(text: str) -> list[tuple[int, float | None]]:
    """Frames in a text such as ``5,41,121``, or the whole of what ``facert suggest`` prints.

    Raises `ScriptError` when there are none.
    """
    text = text.rsplit("in order of time:", 1)[-1].strip()
    if not re.fullmatch(r"\d+(?:[\s,;]+\d+)*[\s,;]*", text):
        raise ScriptError(f"expected frames such as 5,41,121, found {text[:40]!r}")
    numbers = sorted(set(map(int, re.findall(r"\d+", text))))
    return [(int(_within(number, 0, MAX_FRAME, "a frame")), None) for number in numbers]


def write_poses(path: str, poses: Sequence[Pose], fps: float) -> None:
    """Write poses, all of the same controls, as ``facert convert --poses`` reads them.

    To a .csv, or to a .h5 where the program's Python has h5py; whole or not at all.

    Raises `ScriptError` when there are none, or they cannot be written.
    """
    if not poses:
        raise ScriptError("no pose to write")
    temporary = f"{path}.part"
    try:
        if path.lower().endswith((".h5", ".hdf5")):
            _write_h5(temporary, poses, fps)
        else:
            _write_csv(temporary, poses)
        Path(temporary).replace(path)
    except OSError as error:
        with suppress(OSError):
            Path(temporary).unlink()
        raise ScriptError(f"{path}: cannot be written: {error.strerror or error}") from error


def _write_csv(path: str, poses: Sequence[Pose]) -> None:
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["frame", "seconds", *map(_as_text, poses[0].values)])
        for pose in poses:
            values = [f"{round(value, 6) + 0.0:.6g}" for value in pose.values.values()]
            writer.writerow([pose.frame, f"{pose.seconds:.6f}", *values])


def _write_h5(path: str, poses: Sequence[Pose], fps: float) -> None:
    """A take whose frames are the poses, by their seconds."""
    try:
        import h5py
    except ImportError:
        fix = "write a .csv, which facert convert --poses reads as well"
        raise ScriptError(f"this program's Python has no h5py for a .h5: {fix}") from None
    values = [list(pose.values.values()) for pose in poses]
    # In memory first: HDF5 crashes at the end of a program whose file it could not write.
    with h5py.File(path, "w", driver="core", backing_store=False) as file:
        file.attrs.update({"format": "facert-take", "format_version": 1, "fps": fps, "units": ""})
        file["time"] = [pose.seconds for pose in poses]
        for group, name in (("source", "weights"), ("target", "params")):
            file[f"{group}/{name}"] = values
            file.create_dataset(
                f"{group}/names", data=list(poses[0].values), dtype=h5py.string_dtype()
            )
        file.flush()
        content = file.id.get_file_image()
    Path(path).write_bytes(content)


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


def meant(name: str, there: Iterable[str]) -> str:
    """The name, and the nearest of others where one is near."""
    spellings = {spelling(other): other for other in there}
    near = difflib.get_close_matches(spelling(name), spellings, 1, 0.7)
    return f"{name!r} (did you mean {spellings[near[0]]!r}?)" if near else repr(name)


def some(items: Sequence[str], most: int = 6) -> str:
    """Some of the items, and how many more there are."""
    more = f" and {len(items) - most} more" if len(items) > most else ""
    return ", ".join(item if len(item) < 60 else f"{item[:57]}..." for item in items[:most]) + more


def plural(count: int, noun: str) -> str:
    """A count with its noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _side(found: re.Match[str]) -> str:
    return "left" if found.group().lower().endswith("l") else "right"


def _reading(path: str, read: Callable[[str], Read]) -> Read:
    """What a reader makes of a file; whatever it fails with is the file's fault."""
    if not Path(path).is_file():
        raise ScriptError(f"{path or 'no file'}: expected a file, found nothing")
    try:
        return read(path)
    except ScriptError as error:
        raise ScriptError(f"{path}: {error}") from error
    except ArithmeticError as error:
        raise ScriptError(f"{path}: expected numbers of seconds and frames: {error}") from error
    except OSError as error:
        raise ScriptError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (LookupError, ValueError, TypeError, AttributeError, RecursionError) as error:
        text = f"{path}: expected a file that facert wrote, found something else ({error!r:.80})"
        raise ScriptError(text) from error


def _checked(curves: Curves) -> Curves:
    """Curves whose numbers are some; NaN is not known."""
    fps, time = _within(curves.fps, 0.0, MAX_RATE, "a rate"), curves.time
    values = {name: [_known(value) for value in column] for name, column in curves.values.items()}
    spans = [_within(second - time[0], 0.0, MAX_SECONDS, "seconds") for second in time]
    if not fps or any(after <= before for before, after in zip(spans, spans[1:])):
        raise ScriptError("expected rising times, at a rate above 0")
    if not all(
        isinstance(name, str) and len(column) == len(time) for name, column in values.items()
    ):
        raise ScriptError("expected named curves, with a value for each time")
    if all(value is None for column in values.values() for value in column):
        raise ScriptError("expected values, found none")
    return Curves(fps, time, values)


def _known(value: float | None) -> float | None:
    unknown = value is None or value != value
    return None if unknown else _within(value, -1e30, 1e30, "a value")


def _within(value: Any, least: float, most: float, what: str) -> float:
    if not isinstance(value, (int, float)) or not least <= value <= most:
        raise ScriptError(f"expected {what} from {least:g} to {most:g}, found {value!r:.40}")
    return float(value)


def _moment(frame: Any, seconds: Any) -> tuple[int | None, float | None]:
    """A frame and its seconds, if they are some."""
    return (
        None if frame is None else int(_within(int(frame), 0, MAX_FRAME, "a frame")),
        None if seconds is None else _within(float(seconds), -MAX_SECONDS, MAX_SECONDS, "seconds"),
    )


def _read_json(path: str) -> Curves:
    with open(path, encoding="utf-8") as file:
        document = json.load(file)
    rows, fps = document["weightMat"], float(document["exportFps"])
    time = document.get("time") or [row / fps for row in range(len(rows))]
    names = document["facsNames"]
    _require_widths(rows, len(names))
    columns = map(list, zip(*rows))
    return Curves(fps, time, dict(zip(names, columns)))


def _read_csv(path: str) -> Curves:
    header, rows = _table(path)
    place = _place(header, CLOCKS[:1])
    if place is None:
        raise ScriptError(f"expected a column time, found {some(header)}: facert convert makes one")
    time = [float(row[place]) for row in rows]
    return Curves(_rate(time), time, _columns(header, rows, {place}))


def _read_pose_table(path: str) -> list[tuple[int | None, float | None, dict[str, float]]]:
    header, rows = _table(path)
    stated = header[0].startswith("time (")
    frame, clock = (None if stated else _place(header, ("frame",))), _place(header, CLOCKS)
    if frame is None and clock is None:
        raise ScriptError(f"expected a column frame or time, found {some(header)}")
    frames = [None if frame is None else int(row[frame]) for row in rows]
    times = [None if clock is None else float(row[clock]) for row in rows]
    return _poses(frames, times, _columns(header, rows, {frame, clock}))


def _read_suggestions(path: str, take: str) -> list[tuple[int, float | None]]:
    with open(path, encoding="utf-8-sig") as file:
        text = file.read()
    if not text.lstrip().startswith("{"):
        return listed_frames(text)
    rows = json.loads(text)["frames"]
    takes = list(dict.fromkeys(row.get("file", "") for row in rows))
    if len(takes) > 1 or take:
        if take not in takes:
            raise ScriptError(f"expected one of the takes {some(takes)}, found {take or 'none'!r}")
        rows = [row for row in rows if row.get("file", "") == take]
    if not rows:
        raise ScriptError("expected frames, found none")
    found = sorted(_moment(row["frame"], row["seconds"]) for row in rows)
    return [(frame, seconds) for frame, seconds in found if frame is not None]


def _table(path: str) -> tuple[list[str], list[list[str]]]:
    with open(path, encoding="utf-8-sig", newline="") as file:
        header, *rows = [row for row in csv.reader(file) if row]
    _require_widths(rows, len(header))
    return [cell[1:] if cell[:1] == "'" and _FORMULA.match(cell) else cell for cell in header], rows


def _as_text(name: str) -> str:
    """A name for a table, with an apostrophe where a spreadsheet would take it for a formula."""
    return f"'{name}" if _FORMULA.match(name) else name


def _require_widths(rows: Sequence[Sequence[Any]], width: int) -> None:
    odd = next((i for i, row in enumerate(rows) if len(row) != width), None)
    if odd is not None:
        raise ScriptError(f"row {odd + 1}: expected {width} values, found {len(rows[odd])}")
    if not rows:
        raise ScriptError("expected rows of values, found none")


def _place(header: Sequence[str], names: Sequence[str]) -> int | None:
    """The column of one of these names; a first one that states its own is the time."""
    if header[0].startswith("time ("):
        return 0
    lower = [name.strip().lower() for name in header]
    return next((lower.index(name) for name in names if name in lower), None)


def _columns(
    header: Sequence[str], rows: Sequence[Sequence[str]], without: set[int | None]
) -> dict[str, list[float | None]]:
    return {
        name: [float(row[column]) if row[column] else None for row in rows]
        for column, name in enumerate(header)
        if column not in without
    }


def _poses(
    frames: Sequence[int | None],
    times: Sequence[float | None],
    columns: dict[str, list[float | None]],
) -> list[tuple[int | None, float | None, dict[str, float]]]:
    rows: list[dict[str, float]] = [{} for _ in frames]
    for name, column in columns.items():
        for row, value in zip(rows, map(_known, column)):
            if value is not None:
                row[name] = value
    return [(*_moment(f, t), row) for f, t, row in zip(frames, times, rows)]


def _rate(time: Sequence[float]) -> float:
    """Frames a second by the usual step."""
    steps = sorted(after - before for before, after in zip(time, time[1:]))
    return 1 / steps[len(steps) // 2] if steps and steps[len(steps) // 2] > 0 else 30.0
