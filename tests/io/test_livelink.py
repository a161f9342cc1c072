import csv
import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.names import ARKIT_NAMES, ARKIT_SHAPES
from facert.data.rate import nominal_rate
from facert.data.take import Controls, Source, Take
from facert.data.timecode import format_timecode, parse_timecode, timecode
from facert.errors import InputError
from facert.io.formats import read_take_file
from facert.io.tables.livelink import read_livelink, write_livelink

DAY = 24 * 3600 * 60_000


@pytest.fixture
def path(tmp_path):
    return tmp_path / "face.csv"


def write(path, names=ARKIT_SHAPES, timecodes=None, rows=None, bom=""):
    timecodes = timecodes or ["01:00:00:00.000", "01:00:00:02.000", "01:00:00:04.000"]
    if rows is None:
        rows = [[str(len(names)), *np.linspace(0, 1, len(names)) * step] for step in range(3)]
    lines = [["Timecode", "BlendShapeCount", *names]]
    lines += [[timecode, *row] for timecode, row in zip(timecodes, rows, strict=True)]
    text = "\n".join(",".join(str(cell) for cell in line) for line in lines)
    path.write_text(f"{bom}{text}\n", encoding="utf-8")


def weights_take(names, values, **changes):
    return Take(time=np.arange(len(values)) / 30, source=Source(values, names), **changes)


@given(st.integers(0, DAY - 1))
def test_a_timecode_is_kept_to_its_last_digit(ticks):
    assert parse_timecode(format_timecode(ticks)) == ticks


def test_frames_of_a_timecode_count_sixtieths_of_a_second():
    assert parse_timecode("13:13:04:31.652") == (13 * 3600 + 13 * 60 + 4) * 60_000 + 31_652
    assert parse_timecode("0:00:01:30") == 90_000
    for wrong in ("13:13:04", "13:61:04:00.0", "13:13:04:60.000", "a:b:c:d", ""):
        assert parse_timecode(wrong) is None


def counting(count, rate, seconds=3.0):
    """Timecodes of rows at a rate, FF counting so many a second, without thousandths."""
    moments = np.arange(3, int(seconds * rate)) / rate
    return [f"01:00:{int(t):02d}:{int((t % 1) * count + 1e-6):02d}" for t in moments]


@pytest.mark.parametrize(
    ("count", "rate"), [(60, 30), (60, 60), (30, 30), (24, 24), (25, 25), (50, 50), (60, 15)]
)
def test_what_a_second_counts_shows_where_seconds_change(path, count, rate):
    codes = counting(count, rate)
    del codes[7:9], codes[rate + 2]
    write(path, ["jawOpen"], codes, [["1", 0.0]] * len(codes))
    take = read_livelink(path)
    assert take.fps == rate
    assert take.time[-1] == pytest.approx(3 - 4 / rate)
    # Read alone, by the take's rate, the start is the same moment.
    assert timecode(take.start_timecode, 1 - 3 / rate, take.fps).startswith("01:00:01:00")


def test_a_plain_start_timecode_counts_the_takes_frames_when_written(path):
    write_livelink(weights_take(["jawOpen"], np.zeros((2, 1)), start_timecode="01:00:00:15"), path)
    assert path.read_text().splitlines()[1].startswith("01:00:00:30.000,")


def test_columns_are_found_by_name_in_any_order_and_spelling(path):
    names = [name.removesuffix("Left") + "_L" if name.endswith("Left") else name
             for name in reversed(ARKIT_SHAPES)]  # fmt: skip
    write(path, names=names, bom="\ufeff")
    take = read_livelink(path)
    assert take.source.names == ARKIT_SHAPES[::-1]
    np.testing.assert_allclose(take.source.values[2], 2 * np.linspace(0, 1, 52), atol=1e-12)


@pytest.mark.parametrize("count", [51, 52, 61])
def test_all_usual_numbers_of_columns_are_read(path, count):
    write(path, names=ARKIT_NAMES[:count])
    assert read_livelink(path).source.names == ARKIT_NAMES[:count]


def test_an_unknown_column_stays_with_a_warning(path, caplog):
    write(path, names=[*ARKIT_SHAPES[:51], "tongeOut"])
    assert read_livelink(path).source.names[-1] == "tongeOut"
    assert "did you mean tongueOut" in caplog.text


def test_rows_without_a_face_are_dropped_and_counted(path, caplog):
    caplog.set_level(logging.INFO)
    rows = [["0"], ["2", 0.1, 0.2], ["0.0", "", ""]]
    write(path, names=ARKIT_NAMES[:2], rows=rows)
    take = read_livelink(path)
    assert len(take) == 1
    assert take.start_timecode == "01:00:00:02.000"
    assert "dropped 2 of 3 rows without a face" in caplog.text


def test_time_goes_on_past_midnight(path):
    write(path, timecodes=["23:59:59:58.000", "00:00:00:00.000", "00:00:00:02.000"])
    np.testing.assert_allclose(read_livelink(path).time, [0, 2 / 60, 4 / 60], atol=1e-12)


def test_rows_whose_time_does_not_rise_are_dropped_and_counted(path, caplog):
    write(path, timecodes=["01:00:00:02.000", "01:00:00:02.000", "01:00:00:04.000"])
    take = read_livelink(path)
    assert take.source.values[:, 1].tolist() == [0.0, pytest.approx(2 / 51)]
    write(path, timecodes=["01:00:00:02.000", "01:00:00:01.000", "01:00:00:02.000"])
    assert len(read_livelink(path)) == 1
    assert "dropped 1 row whose" in caplog.text
    assert "dropped 2 rows whose" in caplog.text


@pytest.mark.parametrize("rate", [24.0, 30.0, 60.0])
def test_the_rate_is_that_of_the_usual_spacing_whatever_the_gaps(rate):
    time = np.delete(np.arange(100) / rate, [20, 21, 50]) + 1e-5 * np.sin(np.arange(97))
    assert nominal_rate(time) == rate


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("01:00:00:06.000,2,0.1", "line 3: expected 4 cells"),
        ("01:00:00:06.000,2,0.1,x", "line 3, column b: expected a number, found 'x'"),
        ("01:00:00:06.000,abc,0.1,0.2", "line 3, column BlendShapeCount: .* found 'abc'"),
        ("one o'clock,2,0.1,0.2", "line 3, column Timecode: expected HH:MM:SS:FF.mmm"),
        ('01:00:00:06.000,2,0.1,"0.2', "line 3"),
        ("01:00:00:06.000,2,inf,0.2", "infinite"),
    ],
)
def test_a_broken_row_is_named_by_its_line(path, line, message):
    path.write_text(f"Timecode,BlendShapeCount,a,b\n01:00:00:04.000,2,0.1,0.2\n{line}\n")
    with pytest.raises(InputError, match=message) as caught:
        read_livelink(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a header and rows"),
        ("Timecode,BlendShapeCount,a\n", "a header and rows"),
        ("time,a\n0,1\n", "Timecode,BlendShapeCount"),
        ("Timecode,BlendShapeCount,a\n01:00:00:04.000,0\n", "rows with a face"),
        ("Timecode,BlendShapeCount,a,a\n01:00:00:04.000,2,1,1\n", "'a' twice"),
    ],
)
def test_a_file_that_is_none_is_refused(path, text, message):
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_livelink(path)


def test_other_encodings_are_refused(path):
    path.write_bytes("Timecode,BlendShapeCount,\xe9\n".encode("latin-1"))
    with pytest.raises(InputError, match="UTF-8"):
        read_livelink(path)


def test_poses_are_written_before_source_weights(path):
    take = weights_take(["jawOpen"], np.full((2, 1), 0.25))
    take = replace(take, controls=Controls(["eyeBlink_L"]), params=[[1.08], [np.nan]])
    write_livelink(take, path)
    read = read_livelink(path)
    assert read.source.names == ARKIT_NAMES
    assert read.source.values[0, 0] == pytest.approx(1.08)
    assert np.count_nonzero(read.source.values) == 1
    assert len(read) == 1
    assert path.read_text().splitlines()[2] == "00:00:00:02.000,0"


def test_what_live_link_cannot_hold_is_refused_before_a_file_is_made(path):
    markers = Take(time=[0.0], source=Source(np.zeros((1, 1, 3)), ["m"]))
    foreign = weights_take(["jawOpn"], np.zeros((1, 1)))
    partial = weights_take(["jawOpen", "jawLeft"], np.array([[0.0, np.nan]]))
    odd_start = weights_take(["jawOpen"], np.zeros((1, 1)), start_timecode="noon")
    for take, message in [
        (markers, "markers only"),
        (foreign, r"'jawOpn' \(nearest: 'jawOpen'\)"),
        (partial, "known in part"),
        (odd_start, "start_timecode"),
    ]:
        with pytest.raises(InputError, match=message) as caught:
            write_livelink(take, path)
        assert str(caught.value).startswith(f"{path}: ")
    assert not path.exists()


@settings(deadline=None, max_examples=25)
@given(st.integers(0, DAY - 1), st.lists(st.integers(1, 90_000), min_size=1, max_size=20))
def test_timecodes_survive_the_way_through_a_file(tmp_path_factory, start, steps):
    path = tmp_path_factory.mktemp("livelink") / "face.csv"
    ticks = start + np.cumsum([0, *steps])
    take = Take(
        time=(ticks - start) / 60_000,
        source=Source(np.zeros((len(ticks), 1)), ["jawOpen"]),
        start_timecode=format_timecode(start),
    )
    write_livelink(take, path)
    codes = [line.split(",")[0] for line in path.read_text().splitlines()[1:]]
    assert codes == [format_timecode(int(tick)) for tick in ticks]
    np.testing.assert_array_equal(read_livelink(path).time, take.time)


@pytest.mark.real
@pytest.mark.parametrize("name", ["rom", "utterance_b"])
def test_a_recording_written_back_equals_the_original(real_data, tmp_path, name):
    original = real_data / "recordings" / f"{name}.csv"
    write_livelink(read_livelink(original), tmp_path / "back.csv")
    with original.open() as one, (tmp_path / "back.csv").open() as other:
        before, after = list(csv.reader(one)), list(csv.reader(other))
    assert after[0] == before[0]
    assert [row[:2] for row in after] == [row[:2] for row in before]
    np.testing.assert_allclose(
        np.array([row[2:] for row in after[1:]], float),
        np.array([row[2:] for row in before[1:]], float),
        atol=1e-6,
    )


@pytest.mark.real
def test_a_recording_with_lost_faces_keeps_the_rest(real_data):
    take = read_livelink(real_data / "recordings" / "utterance_a.csv")
    assert len(take) == 1891
    assert take.fps == 30.0
    assert np.diff(take.time).max() > 2 / 30


def test_a_first_timecode_that_rounds_into_the_next_second_is_read(tmp_path):
    rows = [f"00:00:09:59.9999,61,{','.join(['0.1'] * 61)}"] + [
        f"00:00:{10 + number // 30:02d}:{number % 30:02d},61,{','.join(['0.1'] * 61)}"
        for number in range(1, 90)
    ]
    header = ",".join(["Timecode", "BlendShapeCount", *ARKIT_NAMES])
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n")
    take = read_livelink(tmp_path / "a.csv")
    assert take.start_timecode == "00:00:10:00.000"


def test_a_start_whose_frames_are_beyond_the_rate_is_in_sixtieths(make_take, tmp_path):
    take = replace(
        make_take(frames=3),
        source=Source(np.zeros((3, 61)), ARKIT_NAMES),
        controls=None,
        params=None,
        animation=None,
        start_timecode="00:00:10:59",
        units="",
    )
    write_livelink(take, tmp_path / "b.livelink.csv")
    assert (tmp_path / "b.livelink.csv").read_text().splitlines()[1].startswith("00:00:10:59.000,")


def test_a_recording_that_a_spreadsheet_saved_with_semicolons_is_read(tmp_path):
    path = tmp_path / "face.csv"
    header = "Timecode;BlendShapeCount;JawOpen\n"
    path.write_text(f"{header}01:00:00:00.000;1;0,25\n01:00:00:02.000;1;0,5\n")
    take = read_take_file(path)
    assert take.source.names == ("jawOpen",)
    np.testing.assert_array_equal(take.source.values[:, 0], [0.25, 0.5])


@pytest.mark.parametrize("seconds", [3600, 2])
def test_a_clock_that_is_set_back_goes_on(path, caplog, seconds):
    ticks = 10_800_000 * 20 + 2000 * np.arange(180)
    ticks[90:] -= seconds * 60_000
    codes = [format_timecode(int(tick)) for tick in ticks]
    write(path, ["jawOpen"], codes, [["1", row] for row in range(180)])
    take = read_livelink(path)
    np.testing.assert_allclose(take.time, np.arange(180) / 30, atol=1e-9)
    assert f"the clock steps back by {seconds} s at line 92" in caplog.text


@pytest.mark.parametrize("rows", [16, 29, 50])
def test_a_wrong_rate_counts_the_rows_of_a_short_even_clip_anew_and_tears_no_clock(path, rows):
    codes = [format_timecode(2000 * (503 + i) + 595 - i // 4) for i in range(rows)]
    write(path, ("jawOpen",), codes, [["1", f"{i / 60}"] for i in range(rows)])
    take = read_take_file(path, fps=60.0)
    np.testing.assert_allclose(take.time, np.arange(rows) / 60, atol=1e-3)


def test_a_rate_that_contradicts_known_times_with_rows_missing_is_refused(path):
    frames = np.delete(np.arange(100), [30, 31, 60]).tolist()
    codes = [format_timecode(2000 * (503 + i) + 595 - i // 4) for i in frames]
    write(path, ("jawOpen",), codes, [["1", f"{i / 100}"] for i in frames])
    with pytest.raises(InputError, match="about 30, as timecodes with rows missing"):
        read_take_file(path, fps=60.0)
    assert read_take_file(path, fps=30.0).fps == 30.0
