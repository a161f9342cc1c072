"""Hostile files of every format but HDF5 and models, each written by a small function.

A bomb is small, or a hole on the disk, and declares or repeats what is large; or it is honest but
for one absurd number.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.take import Controls, Source, Take
from facert.io.formats import write_take_file

READ = ("inspect FILE", "convert FILE DIR/out.h5")
RIG = (*READ, "render DIR/take.h5 DIR/out.png --rig FILE")
TAKE = (*READ, "clean FILE DIR/out.h5", "suggest FILE -n 3")


@dataclass(frozen=True)
class Bomb:
    """One hostile file, by the function that writes it into a folder, and commands to try."""

    make: Callable[[Path], Path]
    commands: Sequence[str]


BOMBS: dict[str, Bomb] = {}


def write_take(folder: Path) -> None:
    """A take of 20 poses of a jaw, for a rig to show."""
    params = np.linspace(0, 1, 20)[:, None]
    source, controls = Source(params, ("jaw",)), Controls(("jawOpen",))
    write_take_file(
        Take(np.arange(20) / 25, source, controls=controls, params=params, fps=25.0),
        folder / "take.h5",
    )


def bomb(name: str, ending: str, commands: Sequence[str] = READ) -> Callable[[Any], Any]:
    """Register a function that makes the content of a file: bytes, text, or JSON."""

    def register(content: Callable[[], Any]) -> Callable[[], Any]:
        def make(folder: Path) -> Path:
            path, made = folder / f"bomb{ending}", content()
            if any("take.h5" in command for command in commands):
                write_take(folder)
            if not isinstance(made, bytes | str):
                made = json.dumps(made)
            path.write_bytes(made.encode() if isinstance(made, str) else made)
            return path

        BOMBS[name] = Bomb(make, commands)
        return content

    return register


def each(name: str, ending: str, cases: dict[str, Any], commands: Sequence[str] = READ) -> None:
    """Register several files of one kind, by their content."""
    for case, content in cases.items():
        bomb(f"{name} {case}", ending, commands)(
            content if callable(content) else lambda content=content: content
        )


# ---- holes: 500 MB that take no room on the disk


def hole(ending: str, size: int = 500_000_000, start: bytes = b"") -> None:
    """Register a file of zeros after a beginning."""

    def make(folder: Path) -> Path:
        path = folder / f"bomb{ending}"
        with path.open("wb") as file:
            file.write(start)
            file.truncate(size)
        return path

    BOMBS[f"hole {ending}"] = Bomb(make, READ)


for ending in (".csv", ".json", ".txt", ".trc", ".tsv", ".glb", ".gltf", ".npz"):
    hole(ending)
hole(".c3d", start=b"\x02\x50")

# ---- tables


def table(rows: Sequence[Sequence[object]], names: Sequence[str] = ("time", "a", "b", "c")) -> str:
    """Lines of cells."""
    return "\n".join(",".join(map(str, row)) for row in (names, *rows)) + "\n"


def honest(value: object = 0.5, place: int = 1, row: int = 20) -> str:
    """A table of 40 frames at 25 frames/s with one value changed."""
    rows: list[list[object]] = [[f / 25, f % 7 / 7, f % 5 / 5, f % 3 / 3] for f in range(40)]
    rows[row][place] = value
    return table(rows)


def columns(count: int, rows: int, name: str = "c{}") -> str:
    names = ["time", *(name.format(i) for i in range(count))]
    return table([[f / 25, *[0.25 + f / 8] * count] for f in range(rows)], names)


def markers(count: int, rows: int) -> str:
    names = ["time", *(f"m{i}.{axis}" for i in range(count) for axis in "xyz")]
    values = np.random.default_rng(0).normal(size=(rows, 3 * count)).round(2)
    return table([[f / 25, *row] for f, row in enumerate(values.tolist())], names)


each(
    "csv",
    ".csv",
    {
        "100,000 columns": lambda: columns(100_000, 3),
        "100,000 columns of halves": lambda: columns(50_000, 3, "eye{0}_L,eye{0}_R").replace(
            "0.25", "0.25,0.25"
        ),
        "1,000,000 columns": lambda: columns(1_000_000, 2),
        "100,000 markers": lambda: markers(100_000, 2),
        "20 MB of commas": lambda: "time,a\n" + "," * 20_000_000,
        "20 MB of commas in the header": lambda: "," * 20_000_000 + "\n1,2\n",
        "50 MB of line ends": lambda: "time,a\n" + "\n" * 50_000_000,
        "20 MB of empty cells": lambda: "time,a\n" + ",\n" * 10_000_000,
        "an open quote": lambda: 'time,a\n"' + "x" * 20_000_000,
        "one line of 50 MB": lambda: "x" * 50_000_000,
        "10 MB of digits": lambda: honest("1" * 10_000_000),
        "10 MB of names": lambda: table([[0, 1], [1, 2]], ["time", "n" * 10_000_000]),
        "blanks before a number": lambda: honest(" " * 1_000_000 + "x"),
        "semicolons": lambda: honest().replace(",", ";").replace(".", ",") * 3000,
        "a million rows, one time": lambda: table([[0, 1]] * 1_000_000, ["time", "a"]),
        "dates": lambda: table(
            [[f"2020-01-01 00:00:{i % 60}", 1] for i in range(200_000)], ["t", "a"]
        ),
        "texts": lambda: table([["x" * 20, i] for i in range(200_000)], ["note", "time"]),
        "20,000 timecodes of garbage": lambda: table(
            [[f"{i % 99}:{i % 77}:{i % 99}:{i % 99}", 1] for i in range(20_000)], ["timecode", "a"]
        ),
        "nested quotes": lambda: "time,a\n" + '0,"' + '""' * 5_000_000 + '"\n',
    },
)
each(
    "csv value",
    ".csv",
    {
        "1e300": honest("1e300"),
        "-1e300": honest("-1e300"),
        "1e308 twice": honest("1e308").replace("0.2,", "-1e308,", 1),
        "inf": honest("inf"),
        "denormal": honest("5e-324"),
        "all denormal": table([[f / 25, (f % 5) * 5e-324] for f in range(40)], ["time", "a"]),
        "all 1e300": table([[f / 25, (1 + f % 5) * 1e300] for f in range(40)], ["time", "a"]),
        "time 1e300": honest("1e300", 0, 39),
        "time -1e300": honest("-1e300", 0, 0),
        "time inf": honest("inf", 0, 39),
        "times of denormals": table([[f * 5e-324, f] for f in range(40)], ["time", "a"]),
        "times of 1e300": table([[f * 1e300, f] for f in range(40)], ["time", "a"]),
        "frame 1e300": table([[f if f < 39 else 1e300, f] for f in range(40)], ["frame", "a"]),
        "timecode of garbage": table(
            [[f"99999999:00:00:{f}", f] for f in range(40)], ["timecode", "a"]
        ),
        "a date of the year 9999": table(
            [["9999-12-31 23:59:59" if f else "0001-01-01", f] for f in range(40)], ["date", "a"]
        ),
        "markers of 1e300": lambda: markers(12, 30).replace("0.1", "1e300"),
        "markers in one point": lambda: table(
            [[f / 25, *[0.0] * 9] for f in range(30)],
            ["time", *(f"m{i}.{a}" for i in range(3) for a in "xyz")],
        ),
    },
    TAKE,
)
each(
    "markers",
    ".csv",
    {"2,000": lambda: markers(2_000, 20), "20,000": lambda: markers(20_000, 5)},
    TAKE,
)

# ---- JSON


def frames(value: object = 0.5, time: object = 0.8) -> list[Any]:
    """Frames of a tracker with one value changed."""
    found: list[Any] = [{"time": f / 25, "weights": {"a": f % 7 / 7, "b": f % 5 / 5}}
                        for f in range(40)]  # fmt: skip
    found[20] = {"time": time, "weights": {"a": value, "b": 0.1}}
    return found


def curves(**changed: Any) -> dict[str, Any]:
    """Curves of Audio2Face."""
    rows = [[f % 7 / 7, f % 5 / 5] for f in range(40)]
    plain = {"exportFps": 25, "facsNames": ["a", "b"], "numPoses": 2, "numFrames": 40,
             "weightMat": rows}  # fmt: skip
    return plain | changed


def with_matrix(value: float) -> dict[str, Any]:
    return curves(weightMat=[[value, 1]] + [[f % 7 / 7, 0] for f in range(39)])


def curve_table(count: int) -> list[Any]:
    """Curves with a key each, all at other times: a matrix of their square."""
    return [{"Name": f"c{i}", f"{i}.0": 1.0} for i in range(count)]


each(
    "json",
    ".json",
    {
        "lists 10^5 deep": "[" * 100_000 + "]" * 100_000,
        "objects 10^5 deep": '{"a":' * 100_000 + "1" + "}" * 100_000,
        "900 deep": lambda: '{"weightMat":' + "[" * 900 + "]" * 900 + "}",
        "an open list 20 MB": lambda: "[" * 20_000_000,
        "an integer of 10^5 digits": lambda: json.dumps(frames("X")).replace('"X"', "9" * 100_000),
        "an integer of 4,000 digits": lambda: json.dumps(frames("X")).replace('"X"', "9" * 4_000),
        "a time of 4,000 digits": lambda: json.dumps(frames(0, "X")).replace('"X"', "9" * 4_000),
        "a rate of 4,000 digits": lambda: json.dumps(curves(exportFps="X")).replace(
            '"X"', "9" * 4_000
        ),
        "10 million numbers": lambda: "[" + "0," * 10_000_000 + "0]",
        "10 million in a frame": lambda: '{"frames":[{"w":[' + "0," * 10_000_000 + "0]}]}",
        "a million keys": lambda: [{f"k{i}": 1 for i in range(1_000_000)}] * 2,
        "frames with other names each": lambda: [
            {"time": f, "weights": {f"w{f}": 1, f"v{f}": 2}} for f in range(20_000)
        ],
        "20,000 groups": lambda: [
            {"time": f, **{f"g{i}": {"jawOpen": 1} for i in range(10_000)}} for f in range(3)
        ],
        "a row a name, all one": lambda: {"names": ["a"] * 1_000_000, "frames": [[1]] * 10},
        "a curve table with a time each": lambda: curve_table(8_000),
        "lines": lambda: "{}\n" * 5_000_000,
        "nothing but blanks": lambda: " " * 50_000_000,
        "an empty matrix": lambda: curves(weightMat=[[]] * 2_000_000, facsNames=[], numPoses=0,
                                          numFrames=2_000_000),
        "100,000 names": lambda: curves(
            facsNames=[f"c{i}" for i in range(100_000)], numPoses=100_000, numFrames=3,
            weightMat=[[0.5] * 100_000] * 3
        ),
    },
)  # fmt: skip
each(
    "json value",
    ".json",
    {
        "1e300": frames(1e300),
        "inf": frames(float("inf")),
        "time 1e300": frames(0, 1e300),
        "fps 1e300": curves(exportFps=1e300),
        "fps 1e-300": curves(exportFps=1e-300),
        "fps 0": curves(exportFps=0),
        "fps true": curves(exportFps=True),
        "matrix 1e300": with_matrix(1e300),
        "matrix 1e308": with_matrix(-1.7e308),
        "timecode": curves(startTimecode="99999999999:99:99:99"),
    },
    TAKE,
)

# ---- .npz


def archive(compression: int = zipfile.ZIP_DEFLATED, **arrays: Any) -> bytes:
    """An archive of arrays, or of members that are bytes."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", compression, allowZip64=True) as file:
        for name, array in arrays.items():
            member = array
            if not isinstance(array, bytes):
                held = io.BytesIO()
                np.save(held, array)
                member = held.getvalue()
            file.writestr(f"{name}.npy", member)
    return content.getvalue()


def npy(shape: tuple[int, ...], dtype: str, size: int) -> bytes:
    """A member whose header declares what its zeros may not hold."""
    head = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}"
    text = head.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode() + bytes(size)


NAMES = np.array([f"m{i}" for i in range(4)])
TRACK = np.random.default_rng(0).normal(size=(40, 4, 3))


def track(**changed: Any) -> bytes:
    plain = {"markers": TRACK, "marker_names": NAMES, "fps": np.array(25.0)}
    return archive(**(plain | changed))


def spiked(value: float) -> np.ndarray:
    changed = TRACK.copy()
    changed[20, 1, 1] = value
    return changed


def rig(**changed: Any) -> bytes:
    vertices = np.random.default_rng(0).normal(size=(30, 3))
    plain = {
        "neutral": vertices,
        "faces": np.arange(30).reshape(10, 3),
        "deltas": np.random.default_rng(1).normal(size=(3, 30, 3)) * 0.01,
        "names": np.array(["jawOpen", "b", "c"]),
    }
    return archive(**(plain | changed))


def lied(content: bytes, size: int) -> bytes:
    """The archive with another size for its first member in the central directory."""
    place = content.index(b"PK\x01\x02")
    return content[: place + 24] + struct.pack("<I", size) + content[place + 28 :]


def repeated(count: int) -> bytes:
    """An archive whose directory names one member's bytes again and again."""
    content = archive(a=npy((8_000_000,), "<f8", 64_000_000))
    place = content.index(b"PK\x01\x02")
    entry, end = content[place : content.index(b"PK\x05\x06")], content[-22:]
    entries = b"".join(entry.replace(b"a.npy", b"%05d" % i) for i in range(count))
    tail = struct.pack("<HHIIH", count, count, len(entries), place, 0)
    return content[:place] + entries + end[:8] + tail


each(
    "npz",
    ".npz",
    {
        "1 GB of zeros": lambda: track(markers=npy((40, 1_000_000, 3), "<f8", 960_000_000)),
        "bytes as floats": lambda: track(markers=npy((40, 1_000_000, 3), "|i1", 120_000_000)),
        "shape without bytes": track(markers=npy((40, 10**9, 3), "<f8", 100)),
        "shape of 0 by 10^18": track(markers=npy((0, 10**18, 3), "<f8", 100)),
        "a negative shape": track(markers=npy((-40, -4, 3), "<f8", 100_000)),
        "strings of 10^8 letters": track(marker_names=npy((4,), "<U100000000", 100)),
        "strings of 50 MB": lambda: track(marker_names=npy((4,), "<U3000000", 48_000_000)),
        "a million names": lambda: track(marker_names=npy((1_000_000,), "<U1", 4_000_000)),
        "a size that lies": lied(track(), 2**31),
        "a size of 0": lied(track(), 0),
        "200 members that are one": lambda: repeated(200),
        "100,000 members": lambda: archive(
            zipfile.ZIP_STORED, **{f"k{i}": b"" for i in range(100_000)}
        ),
        "1,000 targets": lambda: track(
            **{f"k{i}": np.zeros((40, 2)) for i in range(1000)},
            **{f"k{i}_names": np.array(["a", "b"]) for i in range(1000)},
        ),
        "a header of 10 MB": lambda: track(
            markers=b"\x93NUMPY\x02\x00" + struct.pack("<I", 10_000_000) + b"(" * 10_000_000
        ),
        "an archive within": track(markers=track()),
        "a frame of no marker": track(markers=np.zeros((40, 0, 3)), marker_names=np.array([], "U")),
    },
)
each(
    "npz value",
    ".npz",
    {
        "1e300": track(markers=spiked(1e300)),
        "inf": track(markers=spiked(np.inf)),
        "all 1e300": track(markers=TRACK * 1e300),
        "all denormal": track(markers=TRACK * 1e-310),
        "fps 1e300": track(fps=np.array(1e300)),
        "fps 1e-300": track(fps=np.array(1e-300)),
        "fps nan": track(fps=np.array(np.nan)),
        "fps -1": track(fps=np.array(-1.0)),
        "time 1e300": track(time=np.arange(40) * 1e300),
        "time 1e-320": track(time=np.arange(40) * 1e-320),
        "last time 1e300": track(time=np.r_[np.arange(39) / 25, 1e300]),
        "complex": track(markers=TRACK.astype(complex)),
        "float128": track(markers=TRACK.astype(np.longdouble) * np.longdouble("1e4000")),
    },
    TAKE,
)
each(
    "npz rig",
    ".npz",
    {
        "neutral 1e300": rig(neutral=np.full((30, 3), 1e300)),
        "one vertex 1e300": rig(neutral=np.r_[np.zeros((29, 3)), [[1e300, 0, 0]]]),
        "deltas 1e300": rig(deltas=np.full((3, 30, 3), 1e300)),
        "no extent": rig(neutral=np.zeros((30, 3)), deltas=np.zeros((3, 30, 3))),
        "denormal": rig(neutral=np.full((30, 3), 5e-324)),
        "faces 2^62": rig(faces=np.full((10, 3), 2**62)),
        "faces of uint64": rig(faces=np.full((10, 3), 2**64 - 1, dtype=np.uint64)),
        "a million vertices": lambda: rig(
            neutral=np.zeros((1_000_000, 3), np.float32) + np.arange(3),
            deltas=npy((3, 1_000_000, 3), "<f4", 36_000_000),
        ),
        "10,000 shapes": lambda: rig(
            deltas=np.zeros((10_000, 30, 3)), names=np.array([f"s{i}" for i in range(10_000)])
        ),
    },
    RIG,
)
