"""Tables of weights and markers that pandas writes."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.foreign.face import (
    FPS,
    MARKERS,
    NAMES,
    POSITIONS,
    TIME,
    WEIGHTS,
    markers_difference,
    weights_difference,
)
from experiments.foreign.trial import Trial
from facert.io.formats import read_take_file

if TYPE_CHECKING:
    import pandas as pd

PROGRAM = "pandas"


def trials() -> list[Trial]:
    """Trials of tables, weights first."""
    return [
        *(_of_csv(about, **options) for about, options in _CSV.items()),
        *(_of_json(orient, make) for orient, make in _JSON.items()),
        Trial(
            PROGRAM, "markers.csv", "markers, columns (LBROW, x) in two rows, `--in-fps`", _two_rows
        ),
        Trial(PROGRAM, "markers_flat.csv", "markers, columns LBROW_X", _flat_markers),
    ]


def _frame() -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(WEIGHTS, columns=list(NAMES))


def _timed() -> pd.DataFrame:
    frame = _frame()
    frame.insert(0, "time", TIME)
    return frame


def _numbered(first: int = 0) -> pd.DataFrame:
    frame = _frame()
    frame.index = frame.index + first
    frame.index.name = "frame"
    return frame


def _stamped() -> pd.DataFrame:
    import pandas as pd

    frame = _frame()
    frame.index = pd.Timestamp("2024-03-01 10:30:00") + pd.to_timedelta(TIME, unit="s")
    frame.index.name = "timestamp"
    return frame


def _elapsed() -> pd.DataFrame:
    import pandas as pd

    frame = _frame()
    frame.index = pd.to_timedelta(TIME, unit="s")
    frame.index.name = "time"
    return frame


def _milliseconds() -> pd.DataFrame:
    frame = _frame()
    frame.insert(0, "timestamp_ms", np.rint(TIME * 1000).astype(int))
    return frame


def _unix() -> pd.DataFrame:
    frame = _frame()
    frame.insert(0, "timestamp", 1_709_289_000.0 + TIME)
    return frame


def _tracked() -> pd.DataFrame:
    """As trackers of videos write it: flags and confidences beside the weights."""
    frame = _timed()
    frame.insert(0, "frame", np.arange(len(frame)) + 1)
    frame["confidence"] = np.round(0.95 + 0.03 * np.cos(9 * TIME), 3)
    frame["success"] = True
    return frame


_CSV: dict[str, dict[str, Any]] = {
    "index without a name": {"make": _timed},
    "no index": {"make": _timed, "index": False},
    "index `frame`, `--in-fps`": {"make": _numbered, "fps": FPS},
    "index `frame` from 1": {"make": lambda: _numbered(1), "fps": FPS},
    "no clock but the index, `--in-fps`": {"make": _frame, "fps": FPS},
    "semicolons, decimal commas": {"make": _timed, "index": False, "sep": ";", "decimal": ","},
    "tabs": {"make": _timed, "index": False, "sep": "\t"},
    "four digits": {"make": _timed, "float_format": "%.4f", "tolerance": 1e-4},
    "all quoted": {"make": _timed, "quoting": csv.QUOTE_ALL},
    "with a byte order mark": {"make": _timed, "encoding": "utf-8-sig", "index": False},
    "index of dates": {"make": _stamped, "tolerance": 1e-5},
    "index of durations": {"make": _elapsed, "tolerance": 1e-5},
    "`timestamp_ms` alone": {"make": _milliseconds, "index": False, "tolerance": 6e-4},
    "Unix time": {"make": _unix, "index": False},
    "`frame`, `confidence`, `success`": {"make": _tracked, "index": False},
}
_JSON: dict[str, Callable[[], pd.DataFrame]] = {
    "records": _timed,
    "split": _timed,
    "columns": _timed,
    "index": _timed,
}


def _of_csv(
    about: str,
    make: Callable[[], pd.DataFrame],
    fps: float | None = None,
    tolerance: float = 1.1e-6,
    **options: Any,
) -> Trial:
    def difference(folder: Path) -> float:
        path = folder / "take.csv"
        make().to_csv(path, **options)
        return weights_difference(read_take_file(path, fps=fps), TIME, WEIGHTS)

    return Trial(PROGRAM, "take.csv", f"weights and times, {about}", difference, tolerance)


def _of_json(orient: Any, make: Callable[[], pd.DataFrame]) -> Trial:
    def difference(folder: Path) -> float:
        path = folder / "take.json"
        make().to_json(path, orient=orient)
        return weights_difference(read_take_file(path), TIME, WEIGHTS)

    return Trial(PROGRAM, "take.json", f"weights and times, orient={orient}", difference, 1.1e-6)


def _marker_table(columns: Any) -> pd.DataFrame:
    import pandas as pd

    index = pd.Index(TIME, name="time")
    return pd.DataFrame(POSITIONS.reshape(len(TIME), -1), index=index, columns=columns)


def _two_rows(folder: Path) -> float:
    import pandas as pd

    columns = pd.MultiIndex.from_product([MARKERS, list("xyz")])
    _marker_table(columns).reset_index(drop=True).to_csv(folder / "markers.csv")
    return markers_difference(read_take_file(folder / "markers.csv", fps=FPS), POSITIONS, FPS)


def _flat_markers(folder: Path) -> float:
    columns = [f"{name}_{axis}" for name in MARKERS for axis in "XYZ"]
    _marker_table(columns).to_csv(folder / "markers.csv")
    return markers_difference(read_take_file(folder / "markers.csv"), POSITIONS, FPS)
