"""Tables as trackers write them: their clocks, units, faces that were lost, and names."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

from facert.data.labelling import labelled
from facert.data.names import ARKIT_SHAPES
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.io.formats import read_take_file, write_take_file
from facert.io.poses import read_poses

FRAMES = 30
rng = np.random.default_rng(1)
WEIGHTS = rng.uniform(0.01, 0.99, size=(FRAMES, 3)).round(4)
NAMES = ["jawOpen", "smile", "browUp"]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "table.csv"


@pytest.fixture(autouse=True)
def _logged(caplog):
    caplog.set_level(logging.INFO, "facert")


def write(path, columns, separator=","):
    """A table of columns by name."""
    cells = zip(*columns.values(), strict=True)
    lines = [separator.join(map(str, row)) for row in cells]
    path.write_text("\n".join([separator.join(columns), *lines]) + "\n")


def weights(names=NAMES):
    return dict(zip(names, WEIGHTS.T, strict=True))


SECONDS = np.arange(FRAMES) / 30
START = np.datetime64("2026-05-01T23:59:59.500")
DATES = [str(START + np.timedelta64(round(1e6 * t), "us")) for t in SECONDS]
OF_DAY = [f"{24 * (date[8:10] != '01') * 0 + int(date[11:13]):02d}{date[13:23]}" for date in DATES]
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


SPELLINGS = [
    *("{}.{}", "{}_{}", "{}:{}", "{} {}", "{}-{}", "{}.t{}", "{}_t{}", "{}.pos{}"),
    *("{}.Translate {}", "{}.translate{}", "{} ({})", "{}[{}]", "{}/{}"),
    *("{} {} (mm)", "{1}_{0}"),
]


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("spelling", SPELLINGS)
def test_markers_are_spelled_in_many_ways(path, spelling, upper):
    markers = ["chin", "lip_L", "brow1", "M:12"]
    positions = 50 * rng.normal(size=(4, 3)) + rng.normal(size=(FRAMES, 4, 3))
    columns = {
        spelling.format(name, axis.upper() if upper else axis): positions[:, m, i].round(6)
        for m, name in enumerate(markers)
        for i, axis in enumerate("xyz")
    }
    write(path, {"time": SECONDS, "success": [1] * FRAMES, **columns})
    source = read_take_file(path).source
    assert source.names == tuple(markers)
    np.testing.assert_array_equal(source.values, positions.round(6))


@pytest.mark.parametrize("spelling", ["{}_{}", "{}[{}]", "{}.{}"])
def test_axes_may_be_numbers(path, spelling):
    positions = (50 * rng.normal(size=(3, 3)) + rng.normal(size=(FRAMES, 3, 3))).round(4)
    columns = {
        spelling.format(name, i): positions[:, m, i]
        for m, name in enumerate(("chin", "lipL", "browR"))
        for i in range(3)
    }
    write(path, {"time": SECONDS, **columns})
    source = read_take_file(path).source
    assert source.names == ("chin", "lipL", "browR")
    np.testing.assert_array_equal(source.values, positions)
    write(path, {"time": SECONDS, **{name: abs(values) for name, values in columns.items()}})
    assert read_take_file(path).source.kind == "weights"


@pytest.mark.parametrize("spelling", ["{}{}", "{}{} (mm)"])
def test_a_capital_may_stand_before_the_axis(path, spelling):
    columns = {spelling.format(n, a): 90 * WEIGHTS[:, 0] for n in ("lipL", "lipR") for a in "XYZ"}
    write(path, {"time": SECONDS, **columns})
    assert read_take_file(path).source.names == ("lipL", "lipR")


@pytest.mark.parametrize("names", [("X_{}", "Y_{}", "Z_{}"), ("x{}", "y{}", "z{}")])
def test_axes_may_stand_before_a_number(path, names):
    positions = 50 * rng.normal(size=(FRAMES, 3, 68))
    columns = {names[i].format(m): positions[:, i, m] for i in range(3) for m in range(68)}
    write(path, {"time": SECONDS, **columns})
    np.testing.assert_array_equal(read_take_file(path).source.values, positions.transpose(0, 2, 1))


def test_a_name_may_state_the_unit_of_positions(path):
    write(path, {"time": SECONDS, **{f"chin {axis} [mm]": 9 * WEIGHTS[:, 0] for axis in "XYZ"}})
    assert read_take_file(path).units == "mm"


WEIGHTS_LIKE_MARKERS = {
    "rotations": ["jaw_rot_x", "jaw_rot_y", "jaw_rot_z"],
    "rotations beside others": ["jaw_rot_x", "jaw_rot_y", "jaw_rot_z", "smile"],
    "few of many": ["gaze.x", "gaze.y", "gaze.z", *ARKIT_SHAPES[:9]],
    "clipped weights": ["a.x", "a.y", "a.z", "b.x", "b.y", "b.z"],
    "two axes": ["look_x", "look_y"],
    "nothing between": ["mouthx", "mouthy", "mouthz"],
    "capitals": ["PHONEX", "PHONEY", "PHONEZ"],
}


@pytest.mark.parametrize("kind", WEIGHTS_LIKE_MARKERS)
def test_weights_may_be_named_like_coordinates(path, kind):
    names = WEIGHTS_LIKE_MARKERS[kind]
    values = np.clip(rng.normal(0.5, 0.6, size=(FRAMES, len(names))), 0, 1)
    write(path, {"time": SECONDS, **dict(zip(names, values.T, strict=True))})
    assert read_take_file(path).source.names == tuple(names)


@pytest.mark.parametrize("scale", [0.001, 0.1, 1.0])
def test_small_positions_are_positions(path, scale):
    """A face in metres, and the head moves as well."""
    rest = rng.normal(0, 60, size=(1, 9, 3))
    moving = rest + 4 * rng.normal(size=(FRAMES, 9, 3)) + 100 * rng.normal(size=(FRAMES, 1, 3))
    columns = {f"m{i}_{a}": scale * moving[:, i, j] for i in range(9) for j, a in enumerate("xyz")}
    write(path, {"time": SECONDS, **columns})
    assert read_take_file(path).source.kind == "markers"


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


def test_separators_inside_of_quotes_do_not_count(path):
    path.write_text('time,"a;b;c","d;e"\n0,1,2\n0.5,3,4\n')
    assert read_take_file(path).source.names == ("a;b;c", "d;e")


def test_a_table_without_names_is_refused_plainly(path):
    path.write_text("0.1,0.2,0.35\n0.1,0.2,0.3\n")
    with pytest.raises(InputError, match="names of the columns"):
        read_take_file(path, fps=30)


def rows_of(positions, front):
    """Lines of trajectories (T, M, 3) behind cells in front."""
    cells = zip(front, positions.reshape(len(positions), -1).round(4), strict=True)
    return [",".join([*map(str, first), *map(str, row)]) for first, row in cells]


POSITIONS = 50 * rng.normal(size=(FRAMES, 3, 3))


def test_trajectories_of_vicon(path):
    body = rows_of(POSITIONS, [(i + 40, 0) for i in range(FRAMES)])
    header = [
        "Trajectories", "120", ",,Ada:chin,,,Ada:lip_L,,,Ada:brow,,,",
        "Frame,Sub Frame" + ",X,Y,Z" * 3, ",," + ",".join(["mm"] * 9),
    ]  # fmt: skip
    path.write_text("\n".join([*header, *body[:4], "44,0,,,,1,2,3,4,5,6", *body[5:]]))
    take = read_take_file(path)
    assert take.source.names == ("Ada:chin", "Ada:lip_L", "Ada:brow")
    assert (take.fps, take.units) == (120, "mm")
    assert np.flatnonzero(~take.source.valid.all(axis=1)).tolist() == [4]
    np.testing.assert_array_equal(take.source.values[5:], POSITIONS[5:].round(4))


def test_trajectories_of_motive(path):
    names = [name for name in ("chin", "lip", "brow") for _ in range(3)]
    header = [
        "Format Version,1.23,Capture Frame Rate,120.000000,Length Units,Centimeters", "",
        ",Type" + ",Marker" * 9, ",Name," + ",".join(f"Face:{name}" for name in names),
        ",ID" + ",1:1" * 3 + ",1:2" * 3 + ",1:3" * 3, ",Parent" + "," * 9, "," + ",Position" * 9,
        "Frame,Time (Seconds)" + ",X,Y,Z" * 3,
    ]  # fmt: skip
    front = [(i, round(i / 120, 6)) for i in range(FRAMES)]
    path.write_text("\n".join([*header, *rows_of(POSITIONS, front)]))
    take = read_take_file(path)
    assert take.source.names == ("Face:chin", "Face:lip", "Face:brow")
    assert (take.fps, take.units) == (120, "cm")


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


FLAT = POSITIONS.round(4)
XYZ = ",x,y,z" * 3
OF_PANDAS = {
    "names and axes": ["time" + ",chin,chin,chin,lip,lip,lip,brow,brow,brow", XYZ],
    "once": ["time,chin,,,lip,,,brow,,", XYZ],
    "a named index": [",chin,chin,chin,lip,lip,lip,brow,brow,brow", XYZ, "time" + "," * 9],
    "named levels": ["part,chin,,,lip,,,brow,,", "axis" + XYZ, "time" + "," * 9],
}


@pytest.mark.parametrize("kind", OF_PANDAS)
def test_markers_under_two_lines_of_names(path, kind):
    path.write_text("\n".join([*OF_PANDAS[kind], *rows_of(POSITIONS, [(t,) for t in SECONDS])]))
    take = read_take_file(path)
    assert take.source.names == ("chin", "lip", "brow")
    np.testing.assert_array_equal(take.source.values, FLAT)
    np.testing.assert_allclose(take.time, SECONDS)


@pytest.mark.parametrize("second", [",jawOpen,smile", "bodyparts,jawOpen,smile"])
def test_a_second_line_of_names_is_named(path, second):
    path.write_text(f"time,face,face\n{second}\n0,0.1,0.2\n0.5,0.3,0.4\n")
    with pytest.raises(InputError, match=r"line 2.*names again, such as 'smile'"):
        read_take_file(path)


@pytest.mark.parametrize("spelling", ["{}_pos_{}", "{}_POS_{}", "{}{}", "{}_t{}", "{}.pos.{}"])
def test_markers_in_capitals(path, spelling):
    columns = {
        spelling.format(name, axis): POSITIONS[:, m, i].round(4)
        for m, name in enumerate(("LBROW", "CHIN", "RLIP"))
        for i, axis in enumerate("XYZ")
    }
    write(path, {"time": SECONDS, **columns})
    source = read_take_file(path).source
    assert source.names == ("LBROW", "CHIN", "RLIP")
    np.testing.assert_array_equal(source.values, POSITIONS.round(4))


def test_timecodes_may_be_of_semicolons_alone(path):
    codes = [f"01;02;{3 + i // 25:02d};{i % 25:02d}" for i in range(FRAMES)]
    write(path, {"timecode": codes, **weights()})
    take = read_take_file(path)
    assert take.source.names == tuple(NAMES)
    np.testing.assert_allclose(take.time, np.arange(FRAMES) / 25, atol=1e-6)


def test_poses_by_timecode_fit_a_take_of_live_link(path, tmp_path):
    take = Take(np.arange(120) / 60, Source(rng.uniform(size=(120, 52)), ARKIT_SHAPES), fps=60)
    recorded = tmp_path / "face.livelink.csv"
    write_take_file(replace(take, start_timecode="10:00:00:00.000"), recorded)
    write(path, {"timecode": ["10:00:00:30.000", "10:00:01:15.000"], "jaw": [0, 1]})
    assert labelled(read_take_file(recorded), read_poses(path)).labels.tolist() == [30, 75]
