"""No name that a file brings becomes a formula of a spreadsheet; what facert wrote it reads."""

from __future__ import annotations

import csv
import importlib
from pathlib import Path

import numpy as np
import pytest

from facert.data.take import Controls, Source, Take
from facert.data.text import for_csv
from facert.io.formats import read_take_file, write_take_file
from facert.io.registry import require_replaceable

NAMES = (
    "=HYPERLINK(1)", "+1+1", "-2+3", "@SUM(A1)", "'=quoted", "''@twice", "＝wide", "'plain",
    "jaw;=1+1", "lip|x", "-", "plain", "a,\"=b\"", "'", "=1\u200b",
)  # fmt: skip
ENDINGS = (".csv", ".curvetable.csv")


def take_of(names: tuple[str, ...]) -> Take:
    time = np.arange(40) / 30
    values = np.sin(time[:, None] * 7 + np.arange(len(names)))
    return Take(time, Source(values, names))


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_table_comes_back_and_holds_no_formula(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"take{ending}"
    names = [name for name in NAMES if ending == ".csv" or "," not in name]
    if ending != ".csv":  # Unreal takes some of them for one
        names = [name for name in names if name not in ("'", "'plain", "'=quoted")]
    take = take_of(tuple(names))
    write_take_file(take, path)
    with path.open(newline="") as file:
        cells = [cell for row in csv.reader(file) for cell in row]
    texts = [cell for cell in cells if not _is_number(cell)]
    assert not any(text.lstrip()[:1] in set("=+-@＝＋－＠\t\r") for text in texts)
    back = read_take_file(path)
    assert back.source.names == take.source.names
    np.testing.assert_allclose(back.source.values, take.source.values, atol=1e-8)
    require_replaceable(path, overwrite=True)


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def test_markers_and_poses_come_back_too(tmp_path: Path) -> None:
    time = np.arange(30) / 30
    positions = np.random.default_rng(0).normal(size=(30, 3, 3))
    names = ("=M1", "-M2", "M3")
    write_take_file(Take(time, Source(positions, names)), tmp_path / "markers.csv")
    assert read_take_file(tmp_path / "markers.csv").source.names == names
    take = take_of(("a", "b"))
    params = np.linspace(0, 1, 80).reshape(40, 2)
    posed = Take(take.time, take.source, Controls(("=jaw", "@lip")), params)
    write_take_file(posed, tmp_path / "poses.csv")
    assert read_take_file(tmp_path / "poses.csv").source.names == ("=jaw", "@lip")


def test_scripts_of_other_programs_write_and_read_names_alike(tmp_path: Path) -> None:
    shared = importlib.import_module("facert.io.importers.shared")
    for name in NAMES:
        (cell,) = next(csv.reader([for_csv(name)]))
        assert shared._as_text(name) == cell
    poses = [shared.Pose(3, 0.1, dict.fromkeys(NAMES, 0.5))]
    path = str(tmp_path / "poses.csv")
    shared.write_poses(path, poses, 30.0)
    with Path(path).open(newline="") as file:
        assert not any(cell[:1] in "=+@" for cell in next(csv.reader(file)))
    ((_, _, values),) = shared.read_poses(path)
    assert tuple(values) == NAMES
