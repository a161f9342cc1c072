"""Clocks without a clock's name: by shape, in an index without a name, beside a rate."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facert.data.take import Take
from facert.errors import InputError
from facert.io.formats import read_take_file, write_take_file

ROWS = np.delete(np.arange(200), [20, 21, 22, 90, 91])


def write(path: Path, clock: str, cells: list[str], **others: list[str]) -> Path:
    smile = [f"{0.5 + 0.4 * np.sin(row / 9):.4f}" for row in range(len(cells))]
    columns = {clock: cells, **others, "mouthSmile": smile}
    lines = [",".join(columns), *(",".join(row) for row in zip(*columns.values(), strict=True))]
    path.write_text("\n".join(lines) + "\n")
    return path


def seconds(rate: float = 30.0) -> list[str]:
    return [f"{row / rate:.4f}" for row in ROWS]


def length(take: Take) -> float:
    return float(take.time[-1] - take.time[0])


@pytest.mark.parametrize("name", ["Zeit", "", "Unnamed: 0", "index", "horloge"])
@pytest.mark.parametrize("fps", [None, 30.0])
def test_seconds_under_another_name_are_the_clock_with_a_rate_and_without(
    tmp_path: Path, name: str, fps: float | None
) -> None:
    take = read_take_file(write(tmp_path / "a.csv", name, seconds()), fps=fps)
    assert take.source.names == ("mouthSmile",)
    assert take.fps == 30.0
    assert length(take) == pytest.approx(199 / 30, abs=1e-3)


def test_a_rate_that_contradicts_an_even_clock_counts_it_anew(tmp_path: Path) -> None:
    take = read_take_file(write(tmp_path / "a.csv", "Zeit", seconds()), fps=25.0)
    assert take.source.names == ("mouthSmile",)
    assert length(take) == pytest.approx(199 / 25, abs=1e-3)


def test_a_rate_that_contradicts_an_uneven_clock_is_refused(tmp_path: Path) -> None:
    shaken = ROWS / 30 + np.random.default_rng(0).uniform(-0.007, 0.007, len(ROWS))
    path = write(tmp_path / "a.csv", "Zeit", [f"{one + 1:.4f}" for one in shaken])
    with pytest.raises(InputError, match="uneven"):
        read_take_file(path, fps=60.0)


@pytest.mark.parametrize(
    "form", ["0 days 00:00:{:09.6f}", "00:00:{:06.3f}", "2026-03-01 10:00:{:09.6f}"]
)
def test_a_nameless_index_of_times_is_the_clock(tmp_path: Path, form: str) -> None:
    path = write(tmp_path / "a.csv", "", [form.format(row / 30) for row in ROWS])
    assert length(read_take_file(path)) == pytest.approx(199 / 30, abs=2e-3)


def test_numbers_of_rows_are_no_clock(tmp_path: Path) -> None:
    for numbers in (range(195), range(0, 1950, 10), ROWS):
        path = write(tmp_path / "a.csv", "", [str(number) for number in numbers])
        with pytest.raises(InputError, match="time"):
            read_take_file(path)
        assert read_take_file(path, fps=30.0).source.names == ("mouthSmile",)


def test_a_ramp_of_a_weight_is_no_clock_beside_a_rate(tmp_path: Path) -> None:
    ramp = [f"{row / 195:.4f}" for row in range(195)]
    take = read_take_file(write(tmp_path / "a.csv", "ctrl_7", ramp), fps=30.0)
    assert take.source.names == ("ctrl_7", "mouthSmile")


def test_a_column_that_states_a_broken_rate_counts_timecodes(tmp_path: Path) -> None:
    codes = [f"01:00:{row // 30:02d}:{row % 30:02d}" for row in range(200)]
    path = write(tmp_path / "a.csv", "timecode", codes, fps=["29.97"] * 200)
    take = read_take_file(path)
    assert take.fps == 30000 / 1001
    assert length(take) == pytest.approx(199 * 1.001 / 30)
    assert take.start_timecode == "01:00:00:00"
    assert length(read_take_file(path, fps=30.0)) == pytest.approx(199 / 30)
    path = write(tmp_path / "b.csv", "timecode", codes, fps=["30"] * 200)
    assert read_take_file(path).fps == 30.0


def test_an_empty_name_to_keep_is_refused_as_such(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected the name of a column"):
        read_take_file(write(tmp_path / "a.csv", "time", seconds()), keep=("",))


@pytest.mark.parametrize(("count", "gone"), [(30, 2), (60, 4)])
def test_drop_frame_with_colons_shows_in_the_numbers_that_are_missing(
    tmp_path: Path, count: int, gone: int
) -> None:
    before = [f"01:01:59:{frame:02d}" for frame in range(count)]
    after = [f"01:02:00:{frame:02d}" for frame in range(count)]
    take = read_take_file(write(tmp_path / "a.csv", "timecode", before + after[gone:]))
    assert take.fps == pytest.approx(count / 1.001)
    np.testing.assert_allclose(np.diff(take.time), 1.001 / count)
    for rest in (after, after[1:], after[gone + 1 :]):
        assert read_take_file(write(tmp_path / "a.csv", "timecode", before + rest)).fps == count
    ten = [one.replace("01:01", "01:09") for one in before]
    later = [one.replace("01:02", "01:10") for one in after[gone:]]
    assert read_take_file(write(tmp_path / "a.csv", "timecode", ten + later)).fps == count


def test_notes_and_the_size_of_a_picture_are_no_weights(tmp_path: Path) -> None:
    more = {name: ["1920"] * 195 for name in ("width", "image_height")}
    more |= {name: ["0"] * 195 for name in ("done", "checked", "approved", "notes")}
    take = read_take_file(write(tmp_path / "a.csv", "time", seconds(), **more))
    assert take.source.names == ("mouthSmile",)
    assert take.source.valid.all()
    low = {"width": ["0.5"] * 195, "mouthWidth": ["2"] * 195}
    take = read_take_file(write(tmp_path / "a.csv", "time", seconds(), **low))
    assert take.source.names == ("width", "mouthWidth", "mouthSmile")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_a_table_of_utf_16_is_read_by_its_mark(tmp_path: Path, encoding: str) -> None:
    path = write(tmp_path / "a.csv", "time", seconds())
    path.write_text(path.read_text(), encoding=encoding)
    assert read_take_file(path).source.names == ("mouthSmile",)


def test_a_table_says_that_it_has_no_start_timecode(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    take = read_take_file(write(tmp_path / "a.csv", "time", seconds()))
    write_take_file(take, tmp_path / "b.csv")
    assert "start timecode" not in caplog.text
    write_take_file(replace(take, start_timecode="01:00:00:00"), tmp_path / "c.csv")
    assert "no start timecode: 01:00:00:00 is left out" in caplog.text
