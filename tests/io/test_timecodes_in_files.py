"""Timecodes go through files: drop-frame, clocks set back, and columns of tables and JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from facert.data.changes import Changes, converted
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.io.formats import read_take_file, write_take_file

NTSC = 30000 / 1001


def take_of(fps: float, start: str, rows: int = 200) -> Take:
    values = np.linspace(0, 1, rows)[:, None]
    return Take(np.arange(rows) / fps, Source(values, ("jawOpen",)), fps=fps, start_timecode=start)


@pytest.mark.parametrize("fps", [NTSC, 60000 / 1001, 24000 / 1001, 120000 / 1001])
@pytest.mark.parametrize("start", ["00:00:58;00", "23:59:59:10", "", "10:00:00:00.500"])
@pytest.mark.parametrize("ending", ["livelink.csv", "json", "h5", "csv"])
def test_rates_of_television_go_through_files(tmp_path: Path, ending, start, fps) -> None:
    path = tmp_path / f"a.{ending}"
    take = take_of(fps, start)
    write_take_file(take, path)
    back = read_take_file(path)
    assert back.fps == fps
    np.testing.assert_allclose(back.time, take.time, atol=2e-5)
    if start and ending != "csv":
        drops = ";" in start and round(fps) % 30 == 0
        assert (";" in back.start_timecode) == (";" in start if ending != "livelink.csv" else drops)


def test_drop_frame_rows_are_written_with_their_numbers(tmp_path: Path) -> None:
    path = tmp_path / "a.livelink.csv"
    write_take_file(take_of(NTSC, "00:00:59;27", 5), path)
    codes = [line.split(",")[0] for line in path.read_text().splitlines()[1:]]
    assert codes == ["00:00:59;27", "00:00:59;28", "00:00:59;29", "00:01:00;02", "00:01:00;03"]


def test_a_start_is_taken_as_drop_frame_or_refused() -> None:
    take = take_of(NTSC, "")
    for asked in ("01:00:00;00", "01;00;00;00", "01:00:00.00"):
        found = converted(take, Changes(start_timecode=asked))
        assert found.start_timecode == "01:00:00;00"
    with pytest.raises(InputError, match="a number that drop-frame has"):
        converted(take, Changes(start_timecode="00:01:00;00"))
    with pytest.raises(InputError, match="--in-fps"):
        converted(take_of(25.0, ""), Changes(start_timecode="01:00:00;00"))
    assert converted(take, Changes(start_timecode="00:01:00:00")).start_timecode == "00:01:00:00"


@pytest.mark.parametrize(
    ("fps", "start", "new"),
    [(24.0, "01:00:00;15", "01:00:00:12"), (59.94, "01:00:00;15", "01:00:00;30"),
     (30.0, "01:00:00;15", "01:00:00:15"), (23.976, "01:00:00:15", "01:00:00:12")],
)  # fmt: skip
def test_the_start_is_counted_at_the_new_rate(fps, start, new) -> None:
    assert converted(take_of(NTSC, start), Changes(fps=fps)).start_timecode == new


def test_a_clock_in_a_table_or_json_that_is_set_back_goes_on(tmp_path: Path, caplog) -> None:
    times = np.arange(90) / 30 + 5
    times[50:] -= 2
    rows = "".join(f"{time:.4f},{i / 100}\n" for i, time in enumerate(times))
    (tmp_path / "a.csv").write_text(f"time,jawOpen\n{rows}")
    document = {"exportFps": 30, "facsNames": ["a"], "weightMat": [[i / 100] for i in range(90)]}
    (tmp_path / "a.json").write_text(json.dumps({**document, "time": times.tolist()}))
    for name, place in (("a.csv", "line 52"), ("a.json", "row 51")):
        caplog.clear()
        take = read_take_file(tmp_path / name)
        np.testing.assert_allclose(np.diff(take.time), 1 / 30, atol=2e-4)
        assert f"back by 2 s at {place}" in caplog.text


@pytest.mark.parametrize("header", ["Timecode", "timeCode", "TC"])
def test_a_table_of_timecodes_knows_what_they_count(tmp_path: Path, header: str) -> None:
    path = tmp_path / "a.csv"
    rows = [f"00:00:{59 + i // 30 if i < 30 else 0:02d};{i % 30:02d}" for i in range(30)]
    rows += [f"00:01:00;{i:02d}" for i in range(2, 30)]
    path.write_text(f"{header},jawOpen\n" + "".join(f"{row},{i}\n" for i, row in enumerate(rows)))
    take = read_take_file(path)
    assert (take.fps, take.start_timecode) == (NTSC, "00:00:59;00")
    np.testing.assert_allclose(take.time, np.arange(58) / NTSC)


def test_in_fps_settles_what_a_short_clip_leaves_open(tmp_path: Path, caplog) -> None:
    path = tmp_path / "a.csv"
    rows = "".join(f"00:00:00:{i:02d},1,{i / 12}\n" for i in range(12))
    path.write_text(f"Timecode,BlendShapeCount,JawOpen\n{rows}")
    assert read_take_file(path).fps == 30.0
    assert "taken as 30" in caplog.text
    for fps in (12.0, 24.0, 25.0, 30.0, 60.0):
        take = read_take_file(path, fps=fps)
        np.testing.assert_allclose(take.time, np.arange(12) / fps)
        assert take.fps == fps
