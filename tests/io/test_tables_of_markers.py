"""Tables of markers: how their names spell the axes, and headers of several lines."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from table_files import FRAMES, SECONDS, WEIGHTS, rng, write

from facert.data.names import ARKIT_SHAPES
from facert.errors import InputError
from facert.io.formats import read_take_file


@pytest.fixture
def path(tmp_path):
    return tmp_path / "table.csv"


@pytest.fixture(autouse=True)
def _logged(caplog):
    caplog.set_level(logging.INFO, "facert")


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
