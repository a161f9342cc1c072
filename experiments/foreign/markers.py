"""Marker files that ezc3d writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.foreign.face import MARKERS, POSITIONS, markers_difference
from experiments.foreign.trial import Trial
from facert.data.arrays import FloatArray
from facert.io.formats import read_take_file

PROGRAM = "ezc3d"
_TOLERANCE = 1e-4
"""Millimetres, in float32."""


def trials() -> list[Trial]:
    """Trials of C3D files."""

    def trial(compared: str, difference: Callable[[Path], float]) -> Trial:
        return Trial(PROGRAM, "take.c3d", f"markers, {compared}", difference, _TOLERANCE)

    return [
        trial("mm at 100 frames/s", _plain),
        trial("residual -1", _residuals),
        trial("NaN", _gaps),
        trial("a subject before the names", lambda at: _difference(at, _prefixed("Anna:"))),
        trial("unlabelled points among them", _unlabelled),
        trial("frames from 317 on", _late),
        trial("1,500 analogue samples beside them", _analogue),
        trial("600 points, LABELS2", _many),
        *(trial(f"{rate:g} frames/s", _at(rate)) for rate in (23.976, 29.97, 59.94, 119.88)),
    ]


def _file(positions: FloatArray, labels: Sequence[str], rate: float = 100.0) -> Any:
    """A C3D file of positions (T, M, 3) in mm."""
    import ezc3d

    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [rate]
    point["UNITS"]["value"] = ["mm"]
    point["LABELS"]["value"] = list(labels)
    points = np.ones((4, positions.shape[1], len(positions)))
    points[:3] = positions.transpose(2, 1, 0)
    file["data"]["points"] = points
    return file


def _difference(
    folder: Path,
    labels: Sequence[str] = MARKERS,
    positions: FloatArray = POSITIONS,
    expected: FloatArray = POSITIONS,
    rate: float = 100.0,
    change: Callable[[Any], None] | None = None,
) -> float:
    path = folder / "take.c3d"
    file = _file(positions, labels, rate)
    if change:
        change(file)
    file.write(str(path))
    take = read_take_file(path)
    if take.units != "mm":
        raise ValueError(f"units {take.units!r}")
    return markers_difference(take, expected, rate)


def _plain(folder: Path) -> float:
    return _difference(folder)


def _at(rate: float) -> Callable[[Path], float]:
    return lambda folder: _difference(folder, rate=rate)


def _prefixed(subject: str) -> list[str]:
    return [subject + name for name in MARKERS]


def _hidden() -> FloatArray:
    hidden = POSITIONS.copy()
    hidden[20:31, 1] = np.nan
    return hidden


def _residuals(folder: Path) -> float:
    def hide(file: Any) -> None:
        residuals = np.zeros((1, len(MARKERS), len(POSITIONS)))
        residuals[0, 1, 20:31] = -1
        file["data"]["meta_points"]["residuals"] = residuals

    return _difference(folder, expected=_hidden(), change=hide)


def _gaps(folder: Path) -> float:
    return _difference(folder, positions=_hidden(), expected=_hidden())


def _unlabelled(folder: Path) -> float:
    positions = np.concatenate([POSITIONS[:, :1] + 300, POSITIONS, POSITIONS[:, :1] - 300], axis=1)
    return _difference(folder, ["*17", *MARKERS, ""], positions)


def _late(folder: Path) -> float:
    def later(file: Any) -> None:
        file["header"]["points"]["first_frame"] = 317
        file["header"]["points"]["last_frame"] = 317 + len(POSITIONS) - 1

    return _difference(folder, change=later)


def _analogue(folder: Path) -> float:
    def sampled(file: Any) -> None:
        file["parameters"]["ANALOG"]["RATE"]["value"] = [1000.0]
        file["parameters"]["ANALOG"]["LABELS"]["value"] = ["force", "sound"]
        file["data"]["analogs"] = np.random.default_rng(0).normal(size=(1, 2, 10 * len(POSITIONS)))

    return _difference(folder, change=sampled)


def _many(folder: Path) -> float:
    path, labels = folder / "many.c3d", [f"m{index:03d}" for index in range(600)]
    positions = np.random.default_rng(1).normal(0, 100, (4, 600, 3))
    _file(positions, labels).write(str(path))
    take = read_take_file(path)
    if list(take.source.names) != labels:
        raise ValueError(f"{len(take.source.names)} names")
    return float(np.abs(take.source.values - positions).max())
