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


FEW = {
    "count": [0.0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1],
    "confidence": [0.9] * 12,
    "MBP": [0.0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0],
    "ramp": np.linspace(0, 1, 12).tolist(),
    "percent": [10.0 * i for i in range(12)],
}
AT = [3, 17, 21, 50, 55, 81, 90, 120, 140, 150, 177, 200]
KEPT = ("MBP", "ramp", "percent")


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("key", ["frame", "time"])
def test_frames_of_json_are_few_poses_as_rows_of_a_table_are(tmp_path, key, nested) -> None:
    path = tmp_path / "poses.json"
    rows = [dict(zip(FEW, row, strict=True)) for row in zip(*FEW.values(), strict=True)]
    clock = [frame if key == "frame" else frame / 10 for frame in AT]
    frames = [
        {key: at, **({"weights": row} if nested else row)}
        for at, row in zip(clock, rows, strict=True)
    ]
    path.write_text(json.dumps(frames))
    poses = read_poses(path)
    assert poses.names == KEPT
    np.testing.assert_array_equal(poses.values[:, 0], FEW["MBP"])
    np.testing.assert_array_equal(poses.frames if key == "frame" else poses.time, clock)


def test_a_track_of_few_poses_is_read_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "poses.npz"
    values = np.array([*FEW.values()]).T
    np.savez(path, weights=values, weight_names=[*FEW], time=np.array(AT) / 10)
    assert read_poses(path).names == KEPT


@pytest.mark.parametrize("number", [None, 1.5, "late"])
def test_frames_of_json_have_whole_numbers(tmp_path: Path, number) -> None:
    path = tmp_path / "poses.json"
    path.write_text(json.dumps([{"frame": 3, "jaw": 0.1}, {"frame": number, "jaw": 0.1}]))
    with pytest.raises(InputError, match=r"poses\.json: frame \d, column frame"):
        read_poses(path)


def test_another_number_of_the_frame_is_told(tmp_path: Path, caplog) -> None:
    caplog.set_level("INFO", "facert")
    path = tmp_path / "poses.csv"
    path.write_text("frame_number,jaw\n3,0.5\n4,0.1\n")
    assert read_poses(path).frames.tolist() == [3, 4]
    assert "'frame_number' is taken for the number of the frame in the take, from 0" in caplog.text


def test_times_of_json_are_no_frames_to_be_counted(tmp_path: Path) -> None:
    path = tmp_path / "poses.json"
    path.write_text(json.dumps([{"time": t, "jaw": t / 9} for t in (1.0, 2.0, 3.0, 4.0)]))
    np.testing.assert_array_equal(read_poses(path, 24).time, [1, 2, 3, 4])


@pytest.mark.parametrize(
    ("header", "cell"), [("Timecode", "01:00:00:{:02d}.000"), ("timestamp_ms", "36000{:02d}")]
)
def test_numbers_of_frames_keep_the_times_beside_them(
    tmp_path: Path, header: str, cell: str
) -> None:
    path = tmp_path / "poses.csv"
    rows = [f"{cell.format(frame)},{frame},0.5\n" for frame in (4, 10)]
    path.write_text(f"{header},frame,jaw\n{''.join(rows)}")
    poses = read_poses(path)
    assert poses.names == ("jaw",)
    np.testing.assert_array_equal(poses.frames, [4, 10])
    np.testing.assert_allclose(poses.time, [3600, 3600], atol=0.2)
    path.write_text("index,frame,jaw\n1,4,0.1\n2,9,0.2\n")
    assert read_poses(path).time is None
