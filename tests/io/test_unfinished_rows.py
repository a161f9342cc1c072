"""A recorder that is killed leaves a row that was not finished: that row alone is lost."""

import json

import numpy as np
import pytest

from facert.errors import InputError
from facert.io.formats import read_take_file
from facert.io.poses import read_poses

ROWS = 6
SHAPES = ["EyeBlinkLeft", "JawOpen", "MouthSmileLeft"]


def table():
    lines = [f"{i / 30:.4f},{0.1 * i:.4f},{0.05 * i:.4f},0.2500" for i in range(ROWS)]
    return "\n".join(["time,blink,jaw,smile", *lines]) + "\n"


def live_link():
    zeros = ",".join(["0.0"] * 58)
    head = ",".join(f"C{i}" for i in range(58))
    lines = [f"10:00:00:{2 * i:02d}.000,61,0.1,0.2,0.{i}5,{zeros}" for i in range(ROWS)]
    return "\n".join([f"Timecode,BlendShapeCount,{','.join(SHAPES)},{head}", *lines]) + "\n"


def face_cap():
    lines = [f"k,{33 * i},{','.join(['0'] * 10)},0.1,0.2,0.{i}5" for i in range(ROWS)]
    return "\n".join(["info,1", f"bs,{','.join(SHAPES)}", *lines]) + "\n"


def trc():
    lines = [f"{i + 1}\t{i / 30:.4f}\t1.5\t2.5\t{i}.5\t4.5\t5.5\t6.5" for i in range(ROWS)]
    head = [
        "PathFileType\t4\t(X/Y/Z)\ta.trc",
        "DataRate\tNumFrames\tNumMarkers\tUnits",
        f"30\t{ROWS}\t2\tmm",
        "Frame#\tTime\ta\t\t\tb\t\t",
        "\t\tX1\tY1\tZ1\tX2\tY2\tZ2",
    ]
    return "\n".join([*head, *lines]) + "\n"


def json_lines():
    row = {"blink": 0.1, "jaw": 0.2, "smile": 0.3}
    rows = [json.dumps({"time": i / 30, "weights": {**row, "jaw": 0.1 * i}}) for i in range(ROWS)]
    return "\n".join(rows) + "\n"


WRITERS = {".csv": table, ".tsv": table, ".txt": face_cap, ".trc": trc, ".json": json_lines}


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize("cut", [5, 9])
def test_an_unfinished_last_row_costs_that_row_and_is_logged(tmp_path, ending, cut, caplog):
    text = WRITERS[ending]()
    text = text.replace(",", "\t") if ending == ".tsv" else text
    whole, killed = tmp_path / f"whole{ending}", tmp_path / f"killed{ending}"
    whole.write_text(text)
    killed.write_text(text[:-cut])
    expected, found = read_take_file(whole), read_take_file(killed)
    assert "not finished" in caplog.text
    assert len(found) == ROWS - 1
    np.testing.assert_array_equal(found.source.values, expected.source.values[:-1])


def test_a_number_that_stops_short_is_not_read(tmp_path, caplog):
    path = tmp_path / "killed.csv"
    path.write_text(table()[:-3])  # 0.25 for 0.2500
    assert len(read_take_file(path)) == ROWS - 1
    assert "line 7" in caplog.text


def test_numbers_without_zeros_at_the_end_are_whole(tmp_path):
    rows = [f"{i / 30:.4f},{0.1234 + 0.01 * i:.4f}" for i in range(1, 6)]
    path = tmp_path / "whole.csv"
    path.write_text("\n".join(["time,jaw", *rows, "0.2000,0.25"]))
    assert len(read_take_file(path)) == 6


def test_a_zero_at_the_end_of_an_exponent_is_no_decimal(tmp_path):
    path = tmp_path / "whole.csv"
    path.write_text("time,jaw\n0,1.5e-270\n0.1,2.5e-324\n0.2,3.5e+154\n0.3,0\n")
    assert len(read_take_file(path)) == 4


def test_live_link_face_loses_its_last_row(tmp_path, caplog):
    path = tmp_path / "killed.csv"
    path.write_text(live_link()[:-40])
    assert len(read_take_file(path)) == ROWS - 1
    assert "not finished" in caplog.text


@pytest.mark.parametrize("ending", [".csv", ".txt"])
def test_a_short_row_in_the_middle_is_refused(tmp_path, ending):
    lines = WRITERS[ending]().splitlines()
    lines[-2] = lines[-2].rpartition(",")[0]
    path = tmp_path / f"broken{ending}"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match="cells"):
        read_take_file(path)


def test_poses_that_somebody_wrote_are_never_left_out(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("frame,jaw,smile\n0,0.1,0.2\n10,0.2,0.3\n20,0.4\n")
    with pytest.raises(InputError, match="3 cells"):
        read_poses(path)
