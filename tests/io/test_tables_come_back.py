"""facert reads the tables that it wrote, whatever the names and the values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.formats import read_take_file, write_take_file
from facert.io.poses import read_poses
from facert.io.tables.csv_table import read_table, write_table

FRAMES = 12
TIME = np.arange(FRAMES) / 30
TRICKY = [
    *("time", "frame", "Time", "timestamp_ms", "confidence", "success", "mouth-confidence", "row"),
    *("a.x", "a.y", "a.z", "jaw_rot_x", "jaw_rot_y", "jaw_rot_z", "b:X", "b:Y", "b:Z", "X_0"),
    *("Y_0", "Z_0", " jawOpen", "jaw;open", ";;", '"', 'say "A"', "a,b", "mund_öffnen", "口", "#"),
    *("Timecode", "BlendShapeCount", "blendShapes.JawOpen", "blendShapes.JawLeft", "AU01_r"),
    *("AU02_r", "AU04_r", "t", "0", "1.5", "time (weights)", "time (markers)", "-", "id", "nan"),
]
COLUMNS = {
    "noise": lambda seed: np.random.default_rng(seed).normal(size=FRAMES),
    "ramp": lambda seed: np.linspace(0.0, 1.0 + seed, FRAMES),
    "counter": lambda seed: seed + np.arange(FRAMES, dtype=np.float64),
    "milliseconds": lambda _seed: np.rint(1000 * TIME),
    "epoch": lambda _seed: 1.7e9 + np.rint(30 * TIME) / 4,
    "flag": lambda seed: np.random.default_rng(seed).integers(0, 2, FRAMES).astype(float),
    "still": lambda seed: np.full(FRAMES, seed / 10),
    "weight": lambda seed: np.random.default_rng(seed).uniform(size=FRAMES),
}
plain = st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp"))
names = st.lists(
    st.sampled_from(TRICKY) | st.text(plain, min_size=1, max_size=8),
    min_size=1, max_size=7, unique=True,
)  # fmt: skip
kinds = st.lists(st.sampled_from([*COLUMNS]), min_size=7, max_size=7)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tables")


def columns_of(names, kinds):
    chosen = zip(names, kinds, strict=False)
    return np.stack([COLUMNS[kind](seed) for seed, (_, kind) in enumerate(chosen)], axis=1)


@settings(deadline=None, max_examples=150)
@given(names, kinds, st.booleans())
@example(["jaw_rot_x", "jaw_rot_y", "jaw_rot_z"], ["weight"] * 7, True)
@example(["a.x", "a.y", "a.z", "smile"], ["noise"] * 7, True)
@example(["frame", "time"], ["counter", "ramp"], False)
@example([" a"], ["milliseconds"], True)
def test_weights_and_poses_come_back(folder, names, kinds, as_poses):
    values = columns_of(names, kinds)
    values[3] = np.nan
    path = folder / "a.csv"
    source = Source(np.ones((FRAMES, 1)), ["other"]) if as_poses else Source(values, names)
    poses = {"controls": Controls(names), "params": values} if as_poses else {}
    write_table(Take(TIME, source, **poses), path, overwrite=True)
    for read in (read_take_file(path).source, read_poses(path)):
        assert read.names == tuple(names)
        np.testing.assert_allclose(read.values, values, rtol=1e-9)
    np.testing.assert_allclose(read_poses(path).time, TIME, rtol=1e-9)


@settings(deadline=None, max_examples=40)
@given(names, kinds, st.booleans())
@example(["frame", "smile"], ["counter"] * 7, False)
def test_curves_come_back(folder, names, kinds, as_poses):
    values = columns_of(names, kinds)
    path = folder / "a.json"
    source = Source(np.ones((FRAMES, 1)), ["other"]) if as_poses else Source(values, names)
    poses = {"controls": Controls(names), "params": values} if as_poses else {}
    write_take_file(Take(TIME, source, **poses), path, overwrite=True)
    for read in (read_take_file(path).source, read_poses(path)):
        assert read.names == tuple(names)
        np.testing.assert_array_equal(read.values, values)


@settings(deadline=None, max_examples=60)
@given(names, kinds, st.booleans())
@example(["t", "time"], ["weight"] * 7, False)
def test_markers_come_back(folder, names, kinds, still):
    values = np.stack([columns_of(names, kinds[i:] + kinds[:i]) for i in range(3)], axis=2)
    values = np.zeros_like(values) if still else values
    path = folder / "a.csv"
    write_table(Take(TIME, Source(values, names)), path, overwrite=True)
    read = read_take_file(path).source
    assert (read.kind, read.names) == ("markers", tuple(names))
    np.testing.assert_allclose(read.values, values, rtol=1e-9)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(1e-3, 1e5), min_size=0, max_size=12), st.sampled_from([0.0, 12.5, 1.7e9]))
@example([33.0, 34, 33, 33, 34, 33], 0.0)
@example([1.0] * 12, 0.0)
def test_times_come_back(folder, steps, start):
    time = start + np.cumsum([0.0, *steps])
    path = folder / "a.csv"
    values = np.random.default_rng(0).uniform(size=(len(time), 2))
    write_table(Take(time, Source(values, ["jawOpen", "smile"])), path, overwrite=True)
    np.testing.assert_allclose(read_take_file(path).time, time, rtol=1e-9, atol=1e-6)


def test_only_what_would_be_read_otherwise_states_its_columns(folder):
    path = folder / "b.csv"
    take = Take(TIME, Source(columns_of("ab", ["weight"] * 2), ["jawOpen", "frame"]))
    write_table(take, path)
    assert path.read_text().startswith('"time (weights)",jawOpen,frame\n')
    write_table(Take(TIME, Source(take.source.values, ["a", "b"])), path, overwrite=True)
    assert path.read_text().startswith('"time",a,b\n')


def test_a_header_may_state_that_columns_are_markers(folder):
    path = folder / "c.csv"
    path.write_text("time (markers),P X,P Y,P Z\n0,0.1,0.2,0.3\n")
    assert read_table(path).source.names == ("P",)
    path.write_text("time (markers),a,b\n0,0.1,0.2\n")
    with pytest.raises(InputError, match=r"NAME\.x"):
        read_table(path)
