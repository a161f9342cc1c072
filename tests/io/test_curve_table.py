"""Curve Tables are as Unreal reads them, by what its source says of each cell."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.formats import read_any, read_take_file, write_take_file

VALUES = np.array([[0.25, 0.5], [1.0 / 3, 0.5], [-0.1, 0.5]])
TAKE = Take([0.0, 0.04, 0.08], Source(VALUES, ("jawOpen", "smile, left")), fps=25.0)


def unreals_csv(path: Path) -> dict[str, dict[float, float]]:
    """Its CreateTableFromCSVString: the first cell is passed over, a blank is 0."""
    header, *rows = list(csv.reader(path.read_text().splitlines()))
    assert all(len(row) == len(header) for row in rows)
    time = [float(cell or 0) for cell in header[1:]]
    table = {row[0]: [float(cell or 0) for cell in row[1:]] for row in rows}
    return {name: dict(zip(time, row, strict=True)) for name, row in table.items()}


def unreals_json(path: Path) -> dict[str, dict[float, float]]:
    """Its CreateTableFromJSONString: every key but Name is a time."""
    rows = json.loads(path.read_text())
    return {row.pop("Name"): {float(k): v for k, v in row.items()} for row in rows}


READERS = {"csv": unreals_csv, "json": unreals_json}


@pytest.mark.parametrize("ending", READERS)
def test_unreal_finds_a_row_a_curve_and_a_column_a_time(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"face.curvetable.{ending}"
    write_take_file(TAKE, path)
    found = READERS[ending](path)
    assert list(found) == ["jawOpen", "smile, left"]
    for column, curve in enumerate(found.values()):
        assert list(curve) == pytest.approx(TAKE.time.tolist())
        assert list(curve.values()) == pytest.approx(VALUES[:, column].tolist(), abs=1e-8)


@pytest.mark.parametrize("ending", READERS)
def test_a_curve_table_is_read_as_it_was_written(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"face.curvetable.{ending}"
    write_take_file(TAKE, path)
    read = read_take_file(path)
    assert read.source.names == TAKE.source.names
    np.testing.assert_allclose(read.source.values, VALUES, atol=1e-8)
    np.testing.assert_allclose(read.time, TAKE.time)
    assert read.fps == 25.0


def test_poses_come_before_the_source(tmp_path: Path) -> None:
    posed = Take(TAKE.time, TAKE.source, Controls(("rig",)), VALUES[:, :1], fps=25.0)
    write_take_file(posed, tmp_path / "face.curvetable.csv")
    assert list(unreals_csv(tmp_path / "face.curvetable.csv")) == ["rig"]


def test_a_table_that_unreal_exported_is_read(tmp_path: Path) -> None:
    path = tmp_path / "unreal.csv"
    path.write_text("---,0.000000,0.033333\nJawOpen,0.1,0.2\nSmile,0.3,0.4\n")
    read = read_any(path, kind="take")
    assert isinstance(read, Take)
    assert read.source.names == ("JawOpen", "Smile")
    assert read.source.values.tolist() == [[0.1, 0.3], [0.2, 0.4]]


def test_a_gap_is_a_key_less_in_json_and_refused_in_csv_where_it_would_be_zero(
    tmp_path: Path,
) -> None:
    values = VALUES.copy()
    values[1, 0] = np.nan
    take = Take(TAKE.time, Source(values, TAKE.source.names), fps=25.0)
    path = tmp_path / "face.curvetable.json"
    write_take_file(take, path)
    assert list(unreals_json(path)["jawOpen"]) == [0.0, 0.08]
    np.testing.assert_allclose(read_take_file(path).source.values, values, atol=1e-8)
    with pytest.raises(InputError, match=r"none for 'jawOpen' in frame 1.*curvetable\.json"):
        write_take_file(take, path.with_suffix(".csv"))
    assert not path.with_suffix(".csv").exists()


@pytest.mark.parametrize("names", [("Jaw Open", "jawopen"), ("None", "jaw"), ("a,", "A")])
def test_names_that_unreal_would_drop_are_refused(tmp_path: Path, names: tuple[str, str]) -> None:
    take = Take(TAKE.time, Source(VALUES, names), fps=25.0)
    with pytest.raises(InputError, match=r"names that differ in Unreal.*--map"):
        write_take_file(take, tmp_path / "face.curvetable.csv")


def test_times_that_are_one_in_single_precision_are_refused(tmp_path: Path) -> None:
    take = Take([1e6, 1e6 + 0.01, 1e6 + 0.02], TAKE.source, fps=100.0)
    with pytest.raises(InputError, match="single precision"):
        write_take_file(take, tmp_path / "face.curvetable.csv")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.curvetable.csv", "---,zero,one\njaw,0,1\n"),
        ("a.curvetable.csv", "---,0,1\njaw,0\n"),
        ("a.curvetable.csv", "---,0,1\njaw,0,open\n"),
        ("a.curvetable.json", '[{"Name": "jaw", "0": "open"}]'),
    ],
)
def test_what_is_no_curve_table_is_named(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match="curvetable"):
        read_take_file(tmp_path / name)
