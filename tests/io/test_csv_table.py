from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.tables.csv_table import read_table, write_table


@pytest.fixture
def path(tmp_path):
    return tmp_path / "table.csv"


def test_columns_are_weights(path):
    path.write_text("time,smile,frown\n0,0.5,1e-3\n0.5,,2\n")
    take = read_table(path)
    assert take.source.names == ("smile", "frown")
    np.testing.assert_array_equal(take.source.values, [[0.5, 0.001], [np.nan, 2]])
    assert take.fps == 2.0


@pytest.mark.parametrize("separator", [".", "_"])
def test_columns_with_coordinates_are_markers_in_any_order(path, separator):
    header = ["z", "x", "y"]
    columns = ",".join(f"{name}{separator}{axis}" for name in ("a_1", "b") for axis in header)
    path.write_text(f"Time,{columns}\n0,3,1,2,6,4,5\n")
    take = read_table(path)
    assert take.source.names == ("a_1", "b")
    np.testing.assert_array_equal(take.source.values, [[[1, 2, 3], [4, 5, 6]]])


def test_a_weight_whose_name_ends_like_a_coordinate_is_a_weight(path):
    path.write_text("time,head_x,smile\n0,1,2\n")
    assert read_table(path).source.names == ("head_x", "smile")


def test_frame_numbers_need_a_rate(path):
    path.write_text("frame,a\n10,1\n11,2\n")
    np.testing.assert_allclose(read_table(path, fps=20.0).time, [0.5, 0.55])
    with pytest.raises(InputError, match="--in-fps"):
        read_table(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n", "a column time"),
        ("time,a\n0,1\n1\n", "line 3: expected 2 cells"),
        ("time,a\n0,one\n", "line 2, column a: expected a number"),
        ("time,a\n0,1\n0,1\n", "/time"),
        ("time,a\n,1\n", "/time"),
        ("time,m.x,m.y,m.z,smile\n0,1,2,3,4\n", "column smile"),
        ("time,m.x,m.y,m.z,n.x\n0,1,2,3,4\n", "column n.x"),
        ("time\n0\n", "1 names|numbers"),
        ("time,a\n0,\n", "at least one observed"),
    ],
)
def test_what_is_wrong_is_named(path, text, message):
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_table(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_poses_are_written_before_the_source(path):
    source = Source(np.zeros((2, 1, 3)), ["m"])
    take = Take(time=[0.0, 0.1], source=source, controls=Controls(["a,b", "c"]),
                params=[[1.0, 2.0], [np.nan, np.nan]])  # fmt: skip
    write_table(take, path)
    assert path.read_text() == '"time","a,b",c\n0,1,2\n0.1,,\n'
    write_table(replace(take, params=None, controls=None), path, overwrite=True)
    assert path.read_text() == '"time",m.x,m.y,m.z\n0,0,0,0\n0.1,0,0,0\n'


@settings(deadline=None, max_examples=25)
@given(arrays.arrays(float, (3, 2, 3), elements=st.floats(-1e3, 1e3)), st.booleans())
def test_a_source_comes_back(tmp_path_factory, values, as_markers):
    path = tmp_path_factory.mktemp("table") / "table.csv"
    values = values if as_markers else values[:, 0]
    values[1, 0] = np.nan
    names = [f"nan_{index}" for index in range(values.shape[1])]
    write_table(Take(time=[0.0, 0.5, 1.0], source=Source(values, names)), path)
    read = read_table(path)
    assert read.source.names == tuple(names)
    np.testing.assert_allclose(read.source.values, values, rtol=1e-9)


@pytest.mark.parametrize(
    ("separator", "comma"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")]
)
def test_tables_as_any_spreadsheet_exports_them(path, separator, comma):
    rows = [["time", "smile", "frown"], ["0", "0.5", "-1.5e-3"], ["0.5", "", ".25"]]
    lines = [separator.join(cell.replace(".", comma) for cell in row) for row in rows]
    path.write_text("\n".join(lines))
    take = read_table(path)
    assert take.source.names == ("smile", "frown")
    np.testing.assert_array_equal(take.time, [0, 0.5])
    np.testing.assert_array_equal(take.source.values, [[0.5, -0.0015], [np.nan, 0.25]])


@pytest.mark.parametrize("row", ["0,5;1.5", "0.5;1,234", "0;1.234,5"])
def test_a_comma_that_may_part_thousands_is_not_guessed(path, row):
    path.write_text(f"time;smile\n{row}\n")
    with pytest.raises(InputError, match=r"line 2, column .* expected a number"):
        read_table(path)
