"""Poses are read from files of any kind."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from facert.errors import InputError
from facert.io.poses import read_poses


def test_a_table_may_name_frames(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("jaw,Frame,smile\n0.1,12,0.2\n\n0.3,4.0,0.4\n")
    poses = read_poses(path)
    assert poses.names == ("jaw", "smile")
    np.testing.assert_array_equal(poses.frames, [12, 4])
    np.testing.assert_array_equal(poses.values, [[0.1, 0.2], [0.3, 0.4]])


def test_a_table_may_give_times(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("time,frame,jaw\n0.5,1,0.1\n1.5,2,0.3\n")
    np.testing.assert_array_equal(read_poses(path).time, [0.5, 1.5])


def test_curves_give_times(tmp_path: Path) -> None:
    path = tmp_path / "poses.json"
    path.write_text(json.dumps({"fps": 10, "names": ["jaw"], "weights": [[0.1], [0.3]]}))
    np.testing.assert_allclose(read_poses(path).time, [0, 0.1])


@pytest.mark.parametrize("number", ["", "x", "1.5", "inf", "nan", "1e30"])
def test_frames_have_whole_numbers(tmp_path: Path, number: str) -> None:
    path = tmp_path / "poses.csv"
    path.write_text(f"frame,jaw\n0,0.5\n{number},0.1\n")
    with pytest.raises(InputError, match=r"poses\.csv: line 3, column frame"):
        read_poses(path)


def test_a_table_with_semicolons_and_decimal_commas_names_frames(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("frame;jaw;smile\n12;0,1;0,2\n4;0;1\n")
    poses = read_poses(path)
    np.testing.assert_array_equal(poses.frames, [12, 4])
    np.testing.assert_array_equal(poses.values, [[0.1, 0.2], [0, 1]])
