from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import facert
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError, OutputExistsError
from facert.io.rig import read_rig, write_rig
from facert.io.take import read_take, write_take


def make_take(frames=6, markers=3, controls=2, seed=0):
    rng = np.random.default_rng(seed)
    params = rng.random((frames, controls))
    params[1::2] = np.nan
    return Take(
        time=np.arange(frames) / 60,
        source=Source(rng.normal(size=(frames, markers, 3)), [f"Ü{i}" for i in range(markers)]),
        controls=Controls([f"c{i}" for i in range(controls)], [[0, 1]] * controls),
        params=params,
        std=np.abs(params),
        animation=rng.random((4, controls)),
        fps=60.0,
        units="cm",
        start_timecode="13:13:04:31.652",
        up_axis="Y",
    )


def make_rig(faces=((0, 1, 2),)):
    rng = np.random.default_rng(0)
    faces = np.array(faces, dtype=np.int64).reshape(-1, 3)
    return Rig(rng.normal(size=(4, 3)), rng.normal(size=(2, 4, 3)), ("a", "b"), faces, "cm")


def assert_same(one, other):
    """Equal in everything but who wrote it."""
    for name in ("time", "params", "std", "animation"):
        a, b = getattr(one, name), getattr(other, name)
        assert (a is None) == (b is None), name
        if a is not None:
            np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(one.source.values, other.source.values)
    assert one.source.names == other.source.names
    for name in ("fps", "units", "start_timecode", "up_axis"):
        assert getattr(one, name) == getattr(other, name)


def test_a_take_comes_back_as_it_was_written(tmp_path):
    take, path = make_take(), tmp_path / "take.h5"
    write_take(take, path)
    read = read_take(path)
    assert_same(read, take)
    assert read.controls.names == take.controls.names
    np.testing.assert_array_equal(read.controls.limits, take.controls.limits)
    assert read.created_by == f"facert {facert.__version__}"


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=25
)
@given(
    st.integers(1, 5), st.integers(1, 4), st.integers(1, 3), st.floats(0, 0.9), st.integers(0, 99)
)
def test_any_take_with_gaps_comes_back(tmp_path, frames, markers, controls, missing, seed):
    take = make_take(frames, markers, controls, seed)
    values = take.source.values.copy()
    values[np.random.default_rng(seed).random(values.shape[:2]) < missing] = np.nan
    values[0, 0] = 0.0
    take = replace(take, source=take.source.with_matrix(values.reshape(frames, -1)))
    write_take(take, tmp_path / "take.h5", overwrite=True)
    assert_same(read_take(tmp_path / "take.h5"), take)


def test_the_same_data_give_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        write_take(make_take(), tmp_path / f"{name}.h5")
        write_rig(make_rig(), tmp_path / f"{name}_rig.h5")
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()
    assert (tmp_path / "one_rig.h5").read_bytes() == (tmp_path / "two_rig.h5").read_bytes()


def test_validity_is_written_when_something_is_missing_and_only_then(tmp_path):
    take = make_take()
    values = take.source.values.copy()
    values[2, 1] = np.nan
    write_take(take, tmp_path / "whole.h5")
    write_take(replace(take, source=Source(values, take.source.names)), tmp_path / "gaps.h5")
    with h5py.File(tmp_path / "whole.h5") as whole, h5py.File(tmp_path / "gaps.h5") as gaps:
        assert "/source/valid" not in whole
        assert np.argwhere(~gaps["/source/valid"][:]).tolist() == [[2, 1]]


def write_by_hand(path, **changes):
    """A take as any h5py script would write it; a change of None leaves the entry out."""
    entries = {
        "/time": [0.0, 0.5, 1.0],
        "/source/weights": np.arange(6, dtype="f4").reshape(3, 2),
        "/source/names": ["a", "b"],
        **{name.replace("__", "/"): value for name, value in changes.items() if "__" in name},
    }
    attributes = {"format": "facert-take", "format_version": 1, "fps": 2.0, "units": ""}
    attributes |= {name: value for name, value in changes.items() if "__" not in name}
    with h5py.File(path, "w") as file:
        for name, value in entries.items():
            if value is not None:
                file[name] = value
        file.attrs.update({name: value for name, value in attributes.items() if value is not None})


def test_a_file_of_another_program_is_read(tmp_path):
    valid = np.array([[1, 1], [1, 0], [1, 1]], dtype=bool)
    write_by_hand(tmp_path / "take.h5", __source__valid=valid)
    take = read_take(tmp_path / "take.h5")
    assert take.source.kind == "weights"
    assert take.source.names == ("a", "b")
    np.testing.assert_array_equal(take.source.valid, valid)
    assert take.controls is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": "facert-rig"}, "attribute format"),
        ({"format": None}, "attribute format"),
        ({"format_version": 3}, "Update facert"),
        ({"format_version": None}, "attribute format_version"),
        ({"fps": None}, "attribute fps"),
        ({"fps": -1.0}, "fps: expected a positive number"),
        ({"__time": [0.0, 1.0, 1.0]}, "/time"),
        ({"__time": None}, "/time"),
        ({"__source__weights": None}, "either /source/markers or /source/weights"),
        ({"__source__markers": np.zeros((3, 2, 3))}, "markers and weights"),
        ({"__source__weights": np.zeros((3, 2, 3))}, r"/source/weights: expected \(T, D\)"),
        ({"__source__weights": np.full((3, 2), np.nan)}, "at least one observed value"),
        ({"__source__weights": np.full((3, 2), np.inf)}, "infinite"),
        ({"__source__names": ["a", "a"]}, "'a' twice"),
        ({"__source__names": ["a"]}, "2 names"),
        ({"__source__valid": np.ones((3, 1), bool)}, "/source/valid"),
        ({"__source__valid": np.zeros((3, 2), bool)}, "at least one observed value"),
        ({"__target__params": np.zeros((3, 2))}, "/target/names"),
        ({"__target__params": np.zeros((2, 1)), "__target__names": ["c"]}, "/target/params"),
        ({"__target__names": ["c"], "__target__limits": [[1.0, 0.0]]}, "/target/limits"),
    ],
)
def test_what_is_wrong_is_named_with_its_file(tmp_path, changes, message):
    path = tmp_path / "take.h5"
    write_by_hand(path, **changes)
    with pytest.raises(InputError, match=message) as caught:
        read_take(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("faces", [((0, 1, 2), (1, 2, 3)), ()])
def test_a_rig_comes_back_as_it_was_written(tmp_path, faces):
    rig, path = make_rig(faces), tmp_path / "rig.h5"
    write_rig(rig, path)
    read = read_rig(path)
    np.testing.assert_array_equal(read.neutral, rig.neutral)
    np.testing.assert_array_equal(read.shapes, rig.shapes)
    np.testing.assert_array_equal(read.faces, rig.faces)
    assert (read.names, read.units, read.colours) == (rig.names, rig.units, None)


def test_the_colours_of_a_rig_come_back(tmp_path):
    rig = replace(make_rig(), colours=np.linspace(0, 1, 12).reshape(4, 3))
    write_rig(rig, tmp_path / "rig.h5")
    np.testing.assert_array_equal(read_rig(tmp_path / "rig.h5").colours, rig.colours)


def test_existing_files_are_kept(tmp_path):
    write_take(make_take(), tmp_path / "take.h5")
    write_rig(make_rig(), tmp_path / "rig.h5")
    with pytest.raises(OutputExistsError):
        write_take(make_take(), tmp_path / "take.h5")
    with pytest.raises(OutputExistsError):
        write_rig(make_rig(), tmp_path / "rig.h5")
