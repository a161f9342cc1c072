"""Hostile tables and JSON, and holes of any format; see `bomb_registry`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.reliability.bomb_registry import BOMBS, READ, TAKE, Bomb, each

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
