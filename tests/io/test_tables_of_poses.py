"""Tables of poses: what is no control, and the clocks that find their frames."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest
from table_files import DATES, FRAMES, SECONDS, rng, weights, write

from facert.data.labelling import labelled
from facert.data.names import ARKIT_SHAPES
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.io.formats import read_take_file, write_take_file
from facert.io.poses import read_poses


@pytest.fixture
def path(tmp_path):
    return tmp_path / "table.csv"


@pytest.fixture(autouse=True)
def _logged(caplog):
    caplog.set_level(logging.INFO, "facert")


@pytest.mark.parametrize("clock", ["frame", "Frame", "frame_id"])
def test_poses_have_no_control_that_is_a_confidence_or_a_clock(path, clock, caplog):
    write(path, {clock: [3, 9, 20], "timecode": ["a", "b", "c"], "confidence": [0.9, 0.8, 0.9],
                 "jaw": [0, 1, 0], "brow": [0, 0.5, 1], "row": [0, 1, 2]})  # fmt: skip
    poses = read_poses(path)
    assert poses.names == ("jaw", "brow")
    assert poses.frames.tolist() == [3, 9, 20]
    assert "'confidence'" in caplog.text
    assert read_poses(path, keep=["confidence"]).names == ("confidence", "jaw", "brow")


def test_times_of_poses_are_seconds_however_far_apart(path):
    times = [10, 20, 30, 40, 50, 60]
    write(path, {"time": times, "a.x": range(6), "a.y": range(0, 120, 20), "a.z": [5] * 6})
    poses = read_poses(path)
    np.testing.assert_array_equal(poses.time, times)
    assert len(poses.names) == 3


CLOCKS_OF_BOTH = {
    "timestamp": 12.5 + SECONDS,
    "timestamp_ms": np.rint(81234 + 1000 * SECONDS),
    "unix time": 1.7e9 + SECONDS.round(3),
    "timecode": [f"10:00:{i // 30:02d}:{i % 30:02d}" for i in range(FRAMES)],
    "datetime": DATES,
    "time": 12.5 + SECONDS,
    "time_s": SECONDS,
}


@pytest.mark.parametrize("name", CLOCKS_OF_BOTH)
def test_poses_by_a_tracker_s_clock_fit_its_take(path, tmp_path, name):
    clock = CLOCKS_OF_BOTH[name]
    write(path, {name: clock, **weights()})
    write_take_file(read_take_file(path), tmp_path / "take.h5")
    write(path, {name: [clock[4], clock[17], clock[29]], "jaw": [0, 1, 0.5]})
    fps = 30 if name == "timecode" else None
    found = labelled(read_take_file(tmp_path / "take.h5"), read_poses(path, fps))
    assert found.labels.tolist() == [4, 17, 29]


def test_poses_by_seconds_are_those_of_the_take_or_of_its_clock(path, caplog):
    write(path, {"timestamp": 0.2 + SECONDS, **weights()})
    take = read_take_file(path)
    write(path, {"time": [0.1, 0.2], "jaw": [0, 1]})
    assert labelled(take, read_poses(path)).labels.tolist() == [3, 6]
    assert "begins at" not in caplog.text.split("0.2, for 0")[1]
    write(path, {"time": [0.3, 0.4], "jaw": [0, 1]})
    assert labelled(take, read_poses(path)).labels.tolist() == [9, 12]
    assert "from its first frame on, not by its clock, which begins at 0.2 s" in caplog.text
    write(path, {"time": [1.1, 1.166667], "jaw": [0, 1]})
    assert labelled(take, read_poses(path)).labels.tolist() == [27, 29]
    assert "by the take's clock, which begins at 0.2 s" in caplog.text


@pytest.mark.parametrize("code", ["10:00:00:12", "10;00;00;12"])
def test_timecodes_of_poses_need_the_rate_of_the_recording(path, code):
    write(path, {"timecode": [code, "10:00:03:25"], "jaw": [0, 1]})
    with pytest.raises(InputError, match="--in-fps"):
        read_poses(path)
    with pytest.raises(InputError, match=r"line 3, column timecode: .* 24 frames"):
        read_poses(path, 24)


def test_poses_by_another_clock_are_refused(path):
    write(path, {"timestamp": SECONDS, **weights()})
    take = read_take_file(path)
    write(path, {"timestamp": [1.7e9, 1.7e9 + 5], "jaw": [0, 1]})
    with pytest.raises(InputError, match=r"such as 0\.967 s, found 1700000000\.000 s"):
        labelled(take, read_poses(path))


def test_poses_by_timecode_fit_a_take_of_live_link(path, tmp_path):
    take = Take(np.arange(120) / 60, Source(rng.uniform(size=(120, 52)), ARKIT_SHAPES), fps=60)
    recorded = tmp_path / "face.livelink.csv"
    write_take_file(replace(take, start_timecode="10:00:00:00.000"), recorded)
    write(path, {"timecode": ["10:00:00:30.000", "10:00:01:15.000"], "jaw": [0, 1]})
    assert labelled(read_take_file(recorded), read_poses(path)).labels.tolist() == [30, 75]
