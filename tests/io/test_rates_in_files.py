"""The rate that is given always counts, and rows that are played come out at their moments."""

from __future__ import annotations

import json
import logging
from pathlib import Path

import numpy as np
import pytest

from facert.data.names import ARKIT_NAMES
from facert.data.rate import nominal_rate
from facert.data.resampling import resampled
from facert.data.take import Controls, Source, Take
from facert.data.timecode import format_timecode
from facert.errors import InputError
from facert.io import formats
from facert.io.poses import read_poses
from facert.mesh.morphs import rig_morphs

NTSC = 30000 / 1001


def take_of(time: np.ndarray, values: np.ndarray, fps: float) -> Take:
    return Take(time, Source(values[:, None], ("jawOpen",)), fps=fps)


TEXTS = {
    "a.csv": "time,a\n" + "".join(f"{i / 50},1\n" for i in range(40)),
    "frames.csv": "frame,a\n" + "".join(f"{i},1\n" for i in range(40)),
    "a.json": json.dumps({"fps": 50, "names": ["a"], "weights": [[1]] * 40}),
    "a.txt": "bs,a\n" + "".join(f"k,{20 * i},0,0,0,0,0,0,0,0,0,0,1\n" for i in range(40)),
    "a.trc": "PathFileType\t4\nDataRate\n50\nFrame#\tTime\ta\n\n"
    + "".join(f"{i}\t{i / 50}\t1\t1\t1\n" for i in range(40)),
    "live.csv": "Timecode,BlendShapeCount,JawOpen\n"
    + "".join(f"00:00:{i:02d}:00.000,1,0.5\n" for i in range(40)),
}


@pytest.mark.parametrize("name", [*TEXTS, "a.npz", "a.h5", "a.glb"])
def test_the_rate_that_is_given_counts_in_every_format(tmp_path: Path, name: str) -> None:
    path, weights = tmp_path / name, np.ones((40, 1))
    if name in TEXTS:
        path.write_text(TEXTS[name])
    elif name == "a.npz":
        np.savez(path, weights=weights, weight_names=["a"], fps=50.0, time=np.arange(40) / 50)
    elif name == "a.h5":
        formats.write_take_file(take_of(np.arange(40) / 50, weights[:, 0], 50.0), path)
    else:
        rig = formats.Rig(np.eye(3), np.ones((1, 3, 3)), ("a",), np.array([[0, 1, 2]]))
        formats.write("morphs", rig_morphs(rig, weights, np.arange(40) / 50, 50.0), path)
    for fps, meant in ((25.0, 25.0), (29.97, NTSC), (120.0, 120.0)):
        take = formats.read_take_file(path, fps=fps)
        assert take.fps == meant
        np.testing.assert_allclose(take.time, np.arange(40) / meant, atol=1e-6)


def test_a_rate_that_uneven_times_contradict_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    times = np.cumsum(1 / (29 + 2 * np.sin(np.arange(300) / 20)))
    path.write_text("time,a\n" + "".join(f"{t:.4f},1\n" for t in times))
    with pytest.raises(InputError, match="--in-fps: expected about 2"):
        formats.read_take_file(path, fps=60.0)


def test_a_rate_that_is_only_for_want_of_one_changes_no_other(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(TEXTS["a.json"])
    assert formats.read_any(path, or_fps=25.0).fps == 50.0


def test_poses_are_counted_as_their_recording_is(tmp_path: Path) -> None:
    path = tmp_path / "live.csv"
    path.write_text(TEXTS["live.csv"])
    np.testing.assert_allclose(read_poses(path, 25.0).time, np.arange(40) / 25)
    path = tmp_path / "now_and_then.csv"  # poses by their seconds: no frames to be counted
    path.write_text("time,jaw\n0,0\n1,0.5\n2,1\n3,0\n")
    np.testing.assert_allclose(read_poses(path, 25.0).time, np.arange(4))


@pytest.mark.parametrize("ending", [".json", ".livelink.csv"])
def test_rows_without_a_face_keep_those_after_them_at_their_moment(
    tmp_path: Path, ending: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "facert")
    rows = [
        f"{format_timecode(36_000_000 * 60 + 2000 * i)},{0 if 40 <= i < 80 else 1},{i / 150:.4f}\n"
        for i in range(150)
    ]
    recording = tmp_path / "recording.csv"
    recording.write_text("Timecode,BlendShapeCount,JawOpen\n" + "".join(rows))
    take = formats.read_take_file(recording)
    assert len(take) == 110
    formats.write_take_file(take, tmp_path / f"a{ending}")
    if ending == ".json":
        rows = json.loads((tmp_path / "a.json").read_text())["weightMat"]
        assert len(rows) == 150
        np.testing.assert_allclose(
            [row[0] for row in rows[80:]], np.arange(80, 150) / 150, atol=1e-4
        )
        assert rows[40:80] == [rows[39]] * 40
        assert "40 missing frames: held" in caplog.text
    else:
        rows = (tmp_path / "a.livelink.csv").read_text().splitlines()[1:]
        assert [row.split(",")[1] for row in rows[39:81]] == ["61", *["0"] * 40, "61"]
        back = formats.read_take_file(tmp_path / "a.livelink.csv")
        np.testing.assert_allclose(back.time, take.time, atol=1e-9)


def clocks() -> dict[str, np.ndarray]:
    """Times of ten minutes at 29.97, at 60, and as a phone gives frames."""
    phone = np.cumsum(1 / (29 + 2 * np.sin(np.arange(17_400) / 300)))
    return {"ntsc": np.arange(17_982) / NTSC, "60": np.arange(36_000) / 60, "phone": phone}


BLINKS = np.array([3.0, 61.5, 299.2, 590.0])


def blinking(time: np.ndarray) -> np.ndarray:
    return np.asarray(np.exp(-0.5 * ((time[:, None] - BLINKS) / 0.08) ** 2).max(axis=1))


def moments(time: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Seconds of the blinks: the centre of gravity of each."""
    near = np.abs(time[:, None] - BLINKS) < 0.5
    return (near * (time * value)[:, None]).sum(axis=0) / (near * value[:, None]).sum(axis=0)


def recorded(clock: str) -> Take:
    time = clocks()[clock]
    return take_of(time - time[0], blinking(time), nominal_rate(time))


@pytest.mark.parametrize("clock", ["ntsc", "60", "phone"])
def test_a_blink_stays_at_its_second_for_ten_minutes(tmp_path: Path, clock: str) -> None:
    take = recorded(clock)
    for ending in ("json", "csv"):
        formats.write_take_file(take, tmp_path / f"a.{ending}")
    document = json.loads((tmp_path / "a.json").read_text())
    by_row = np.array(document["weightMat"])[:, 0]
    assert_there(np.arange(len(by_row)) / document["exportFps"], by_row, clock)
    back = formats.read_take_file(tmp_path / "a.csv")
    assert_there(back.time, back.source.values[:, 0], clock)
    for fps in (24.0, 25.0, NTSC, 30.0, 60.0):
        found = resampled(take, fps)
        assert_there(np.arange(len(found)) / found.fps, found.source.values[:, 0], clock)


@pytest.mark.parametrize("clock", ["ntsc", "phone"])
def test_a_blink_stays_at_its_second_in_live_links_rows(tmp_path: Path, clock: str) -> None:
    take = recorded(clock)
    formats.write_take_file(take, tmp_path / "a.livelink.csv")
    back = formats.read_take_file(tmp_path / "a.livelink.csv")
    assert back.fps == pytest.approx(take.fps, rel=2e-4)
    by_row = back.source.values[:, ARKIT_NAMES.index("jawOpen")]
    assert_there(np.arange(len(by_row)) / take.fps, by_row, clock)


def assert_there(played: np.ndarray, value: np.ndarray, clock: str) -> None:
    """Blinks lie at their seconds, counted from the first frame of the clock."""
    began = clocks()[clock][0]
    got = moments(played + began, value)
    np.testing.assert_allclose(got, moments(clocks()[clock], blinking(clocks()[clock])), atol=2e-3)


def test_a_blink_stays_at_its_second_in_a_glb(tmp_path: Path) -> None:
    rig = formats.Rig(np.eye(3), np.ones((1, 3, 3)), ("jawOpen",), np.array([[0, 1, 2]]))
    for clock, time in clocks().items():
        settings = blinking(time)[:, None]
        path = tmp_path / "a.glb"
        formats.write("morphs", rig_morphs(rig, settings, time, 30.0), path, overwrite=True)
        back = formats.read_take_file(path)
        got = moments(back.time, back.source.values[:, 0])
        np.testing.assert_allclose(got, moments(time, settings[:, 0]) - time[0], atol=2e-3)
        assert back.fps == {"ntsc": NTSC, "60": 60.0}.get(clock, back.fps)


def test_poses_of_a_few_frames_are_not_held(tmp_path: Path) -> None:
    params = np.full((30, 1), np.nan)
    params[[3, 9, 20]] = 0.5
    time = np.delete(np.arange(35) / 30, range(10, 15))
    take = Take(time, Source(np.ones((30, 1)), ("a",)), Controls(("jaw",)), params, fps=30.0)
    formats.write_take_file(take, tmp_path / "a.json")
    rows = json.loads((tmp_path / "a.json").read_text())["weightMat"]
    assert [i for i, row in enumerate(rows) if row != [None]] == [3, 9, 25]
