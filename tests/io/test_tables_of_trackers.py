"""Tables as trackers write them: their clocks, units, and faces that were lost."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from table_files import DATES, FRAMES, NAMES, OF_DAY, SECONDS, WEIGHTS, rng, weights, write

from facert.data.names import ARKIT_SHAPES
from facert.errors import InputError
from facert.io.formats import read_take_file
from facert.io.poses import read_poses


@pytest.fixture
def path(tmp_path):
    return tmp_path / "table.csv"


@pytest.fixture(autouse=True)
def _logged(caplog):
    caplog.set_level(logging.INFO, "facert")


CLOCKS = {
    "time": SECONDS,
    "Time": SECONDS.round(4),
    " timeCode": SECONDS,
    "timestamp": SECONDS + 12.5,
    "time_s": SECONDS,
    "t": SECONDS,
    "Time [ms]": np.rint(1000 * SECONDS),
    "timestamp_ms": np.rint(1000 * SECONDS).astype(int) + 5000,
    "timestampUS": np.rint(1e6 * SECONDS).astype(int),
    "time_ns": np.rint(1e9 * SECONDS).astype(int),
    "ticks": np.rint(1e7 * SECONDS).astype(int),
    "unix time": [f"{1.7e9 + t:.4f}" for t in SECONDS],
    "epoch": [round(1e3 * (1.7e9 + t)) for t in SECONDS],
    "timestamp_of_day": OF_DAY,
    "datetime": DATES,
    "UTC": [f"{date}Z" for date in DATES],
    "Timestamp": [date.replace("T", " ") for date in DATES],
    "elapsed": [f"0 days 00:00:{t:09.6f}" for t in SECONDS],
    "Timecode": [f"01:02:{3 + i // 30:02d}:{i % 30:02d}" for i in range(FRAMES)],
    "zeit": SECONDS,
}


@pytest.mark.parametrize("name", CLOCKS)
def test_a_clock_of_any_name_and_unit_is_the_clock(path, name, caplog):
    write(path, {"": range(FRAMES), name: CLOCKS[name], **weights()})
    take = read_take_file(path)
    assert take.source.names == tuple(NAMES)
    np.testing.assert_array_equal(take.source.values, WEIGHTS)
    np.testing.assert_allclose(take.time, SECONDS, atol=2e-3)
    assert take.fps == 30
    assert name.strip() in caplog.text or name.lower() == "time"


@pytest.mark.parametrize("step", [33, 1000 / 30, 40, 16.6667, 33333, 33_333_333, 333_333, 41667])
def test_a_unit_shows_in_the_step(path, step, caplog):
    write(path, {"time": [round(step * i, 3) for i in range(FRAMES)], **weights()})
    take = read_take_file(path)
    assert 20 < take.fps < 65
    assert "is taken for" in caplog.text
    assert "--in-fps" in caplog.text


@pytest.mark.parametrize(("fps", "rate"), [(60, 60), (30, 30), (24, 24), (59.94, 59.94)])
def test_a_rate_is_found_from_whole_milliseconds(path, fps, rate):
    stamps = np.rint(1000 * np.arange(300) / fps).astype(int)
    write(path, {"timestamp_ms": stamps, "jawOpen": rng.uniform(size=300)})
    assert read_take_file(path).fps == pytest.approx(rate, rel=2e-3)


@pytest.mark.parametrize(
    ("times", "rate"), [([0, 0.5, 1.0, 1.5, 2.0], 2), ([0, 0.2, 0.4, 0.6, 0.8], 5), ([0, 3], 1 / 3)]
)
def test_slow_seconds_are_seconds(path, times, rate):
    write(path, {"time": times, "jawOpen": range(len(times)), "smile": [0.5] * len(times)})
    take = read_take_file(path)
    np.testing.assert_array_equal(take.time, times)
    assert take.fps == pytest.approx(rate)


def test_seconds_that_rise_by_one_may_be_frames(path, caplog):
    write(path, {"time": range(FRAMES), **weights()})
    np.testing.assert_array_equal(read_take_file(path).time, range(FRAMES))
    assert "if it counts frames" in caplog.text


@pytest.mark.parametrize("step", [1e-5, 1e12])
def test_an_unlikely_rate_is_warned_of(path, step, caplog):
    write(path, {"time": step * np.arange(FRAMES), **weights()})
    read_take_file(path)
    assert "unlikely" in caplog.text


def test_without_a_clock_the_rate_must_be_given(path):
    write(path, weights())
    with pytest.raises(InputError, match="--in-fps"):
        read_take_file(path)
    np.testing.assert_allclose(read_take_file(path, fps=25).time, np.arange(FRAMES) / 25)


def test_frame_numbers_count_from_wherever_they_begin(path):
    write(path, {"frame_number": [i + (i > 9) + 101 for i in range(FRAMES)], **weights()})
    time = read_take_file(path, fps=30).time
    assert time[0] == 0
    assert time[-1] == pytest.approx(1)


@pytest.mark.parametrize(("cell", "message"), [("", "line 7"), ("late", "line 7, column time")])
def test_a_row_without_a_time_is_named(path, cell, message):
    write(path, {"time": [*SECONDS[:5], cell, *SECONDS[6:]], **weights()})
    with pytest.raises(InputError, match=message):
        read_take_file(path)


@pytest.mark.parametrize(
    ("name", "cells"),
    [
        ("success", [1, 0]), ("is_tracked", ["true", "false"]), ("face found", ["True", "False"]),
        ("BlendShapeCount", [52, 0]), ("lost", [0, 1]), ("valid", ["yes", "no"]),
        ("confidence", [0.87, 0]),
    ],
)  # fmt: skip
def test_a_row_whose_flag_denies_a_face_is_not_observed(path, name, cells, caplog):
    flags = [cells[int(i < 7)] for i in range(FRAMES)]
    write(path, {"time": SECONDS, **weights(), name: flags}, "\t")
    source = read_take_file(path).source
    assert source.names == tuple(NAMES)
    np.testing.assert_array_equal(source.valid.all(axis=1), np.arange(FRAMES) >= 7)
    assert "7 rows without a face" in caplog.text


def test_columns_that_are_kept_are_weights(path, caplog):
    write(path, {"time": SECONDS, "confidence": WEIGHTS[:, 0], **weights()})
    assert read_take_file(path, keep=["Confidence"]).source.names == ("confidence", *NAMES)
    assert not caplog.records
    with pytest.raises(InputError, match="--keep"):
        read_take_file(path, keep=["conf"])


def test_columns_of_text_are_left_out(path, caplog):
    write(path, {"time": SECONDS, "actor": ["Ada"] * FRAMES, **weights()})
    assert read_take_file(path).source.names == tuple(NAMES)
    assert "as text: 'actor'" in caplog.text


def test_blendshapes_behind_a_prefix_have_arkit_s_names(path):
    names = [f"blendShapes.{name[0].upper()}{name[1:]}" for name in ARKIT_SHAPES]
    values = rng.uniform(size=(FRAMES, 52))
    write(path, {"": range(FRAMES), "timeCode": SECONDS, **dict(zip(names, values.T, strict=True))})
    assert read_take_file(path).source.names == ARKIT_SHAPES


def test_a_table_of_openface_gives_its_action_units(path, caplog):
    units = {f"AU{i:02d}_r": 5 * rng.uniform(size=FRAMES) for i in (1, 2, 4, 12)}
    columns = {
        "frame": range(1, FRAMES + 1), " face_id": [0] * FRAMES, " timestamp": SECONDS.round(3),
        " confidence": [0.98] * FRAMES, " success": [1] * 28 + [0, 0],
        **{f" gaze_0_{axis}": WEIGHTS[:, 0] for axis in "xyz"},
        **{f" pose_R{axis}": WEIGHTS[:, 1] for axis in "xyz"},
        **{f" {axis}_{i}": 100 + WEIGHTS[:, 2] for axis in "XYZ" for i in range(5)},
        **{f" {name}": values for name, values in units.items()},
        " AU01_c": [0.0, 1.0] * 15,
    }  # fmt: skip
    write(path, columns, ", ")
    take = read_take_file(path)
    assert take.source.names == tuple(units)
    assert take.fps == 30
    assert take.source.valid.all(axis=1).sum() == 28
    assert "OpenFace" in caplog.text
    write(path, {name: columns[name] for name in columns if name[1] in "XYZ" or "time" in name})
    assert read_take_file(path).source.values.shape == (FRAMES, 5, 3)


def test_of_several_faces_in_a_frame_one_is_read(path, caplog):
    times, faces = np.repeat(SECONDS, 2), [0, 1] * FRAMES
    values = np.repeat(WEIGHTS, 2, axis=0) + np.array(faces)[:, None]
    write(path, {"timestamp": times[:-1], "face_id": faces[:-1],
                 **dict(zip(NAMES, values[:-1].T, strict=True))})  # fmt: skip
    np.testing.assert_array_equal(read_take_file(path).source.values, WEIGHTS)
    assert "2 faces" in caplog.text


def test_separators_inside_of_quotes_do_not_count(path):
    path.write_text('time,"a;b;c","d;e"\n0,1,2\n0.5,3,4\n')
    assert read_take_file(path).source.names == ("a;b;c", "d;e")


def test_a_table_without_names_is_refused_plainly(path):
    path.write_text("0.1,0.2,0.35\n0.1,0.2,0.3\n")
    with pytest.raises(InputError, match="names of the columns"):
        read_take_file(path, fps=30)


@pytest.mark.parametrize("before", ["# made by a tracker, 2.1\n#\n", "sep=;\n", "\n\n"])
def test_lines_before_the_header_are_passed_over(path, before):
    write(path, {"frame": range(FRAMES), **weights()}, ";")
    path.write_text(before + path.read_text())
    assert read_take_file(path, fps=30).source.names == tuple(NAMES)
    assert read_poses(path).frames is not None


def test_a_column_may_state_the_rate(path, caplog):
    write(path, {"frame": range(FRAMES), "fps": [25] * FRAMES, **weights()})
    assert read_take_file(path).fps == 25
    assert "'fps' states 25" in caplog.text


def test_a_clock_that_stands_still_is_none(path):
    write(path, {"timestamp": [0] * FRAMES, "frame": range(FRAMES), **weights()})
    assert read_take_file(path, fps=25).fps == 25
    write(path, {"timestamp": [0] * FRAMES, **weights()})
    assert read_take_file(path, fps=25).fps == 25
    with pytest.raises(InputError, match="/time"):
        read_take_file(path)


def test_a_time_that_is_there_twice_costs_its_row(path, caplog):
    write(path, {"time": [*SECONDS[:9], *SECONDS[8:-1]], **weights()})
    assert len(read_take_file(path)) == FRAMES - 1
    assert "dropped 1 row" in caplog.text


@pytest.mark.parametrize("blank", ["NA", "null", "NaN", "", "None", "-", "#NUM!", "1.#QNAN"])
def test_cells_without_a_value_are_blank(path, blank):
    write(path, {"time": SECONDS, "jawOpen": [blank, *WEIGHTS[1:, 0]], "smile": WEIGHTS[:, 1]})
    assert np.isnan(read_take_file(path).source.values[0, 0])


def test_a_date_beside_the_time_is_text(path):
    write(path, {"date": ["2026-05-01"] * FRAMES, "time": OF_DAY, **weights()})
    assert read_take_file(path).fps == 30


def test_weights_of_an_archive_have_no_clock_among_them(tmp_path, caplog):
    path = tmp_path / "take.npz"
    values = np.column_stack([1000 * SECONDS, WEIGHTS])
    np.savez(path, weights=values, weight_names=["timestamp_ms", *NAMES], fps=30)
    assert read_take_file(path).source.names == tuple(NAMES)
    assert read_take_file(path, keep=["timestamp_ms"]).source.values.shape == (FRAMES, 4)


def test_milliseconds_of_an_archive_are_seconds(tmp_path, caplog):
    path = tmp_path / "take.npz"
    np.savez(path, weights=WEIGHTS, weight_names=NAMES, time=np.rint(1000 * SECONDS))
    take = read_take_file(path)
    assert take.fps == 30
    np.testing.assert_allclose(take.time, SECONDS, atol=6e-4)
    assert "'time' is taken for milliseconds" in caplog.text


@pytest.mark.parametrize(("name", "hidden"), [("status", 0), ("score", 0), ("tracking_state", 7)])
def test_zero_of_a_vague_flag_hides_nothing(path, name, hidden):
    write(path, {"time": SECONDS, **weights(), name: [int(i >= 7) for i in range(FRAMES)]})
    source = read_take_file(path).source
    assert source.names == tuple(NAMES)
    assert (~source.valid.all(axis=1)).sum() == hidden


def test_times_that_are_no_clock_are_passed_over(path):
    slow = {"time_of_inference_ms": 9 + WEIGHTS[:, 0], "recorded": WEIGHTS[:, 1]}
    write(path, {**slow, "timestamp": SECONDS, **weights()})
    take = read_take_file(path)
    assert take.source.names == tuple(NAMES)
    assert take.fps == 30


def test_live_link_s_table_with_more_columns_has_its_weights_alone(path):
    codes = [f"00:00:01:{2 * i:02d}.000" for i in range(FRAMES)]
    values = rng.uniform(0.01, 1, size=(FRAMES, 52))
    write(path, {"Timecode": codes, "BlendShapeCount": [52] * FRAMES,
                 **dict(zip(ARKIT_SHAPES, values.T, strict=True)), "Timestamp": 1.7e9 + SECONDS,
                 "TrackingConfidence": [0.9] * FRAMES})  # fmt: skip
    assert read_take_file(path).source.names == ARKIT_SHAPES
    lines = path.read_text().splitlines()
    path.write_text("\n".join(f"{i or ''},{line}" for i, line in enumerate(lines)))
    assert read_take_file(path).source.names == ARKIT_SHAPES


def test_timecodes_may_be_of_semicolons_alone(path):
    codes = [f"01;02;{3 + i // 25:02d};{i % 25:02d}" for i in range(FRAMES)]
    write(path, {"timecode": codes, **weights()})
    take = read_take_file(path)
    assert take.source.names == tuple(NAMES)
    np.testing.assert_allclose(take.time, np.arange(FRAMES) / 25, atol=1e-6)
