"""A mesh in motion goes to the disk and back in batches, whole or not at all."""

import tracemalloc

import h5py
import numpy as np
import pytest

from facert.data.rig import Mesh, MeshSequence
from facert.errors import InputError, OutputExistsError
from facert.io.hdf5 import MAX_VALUES
from facert.io.mesh_sequence import new_mesh_sequence, open_mesh_sequence, write_mesh_sequence

RNG = np.random.default_rng(0)
MESH = Mesh(RNG.normal(size=(6, 3)), np.array([[0, 1, 2], [3, 4, 5]]), "cm", RNG.random((6, 3)))
TIME = np.arange(10) / 30
MOTION = MESH.vertices + RNG.normal(size=(10, 6, 3))


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "face.h5"
    write_mesh_sequence(MeshSequence(MESH, TIME, lambda rows: MOTION[rows], 24.0), path)
    return path


def test_what_was_written_comes_back(path):
    with open_mesh_sequence(path) as sequence:
        np.testing.assert_allclose(np.concatenate(list(sequence.batches(3))), MOTION, rtol=1e-6)
        np.testing.assert_array_equal(sequence.time, TIME)
        assert sequence.fps == 24
        for name in ("vertices", "faces", "units", "colours"):
            np.testing.assert_array_equal(getattr(sequence.neutral, name), getattr(MESH, name))


@pytest.mark.parametrize("rows", [[7, 2, 2], [3], [], [4, 5, 6], [9, 8]])
def test_any_frames_can_be_fetched(path, rows):
    with open_mesh_sequence(path) as sequence:
        np.testing.assert_allclose(sequence.fetch(np.array(rows, int)), MOTION[rows], rtol=1e-6)


def test_the_file_is_as_documented(path):
    with h5py.File(path) as file:
        assert file.attrs["format"] == "facert-mesh-sequence"
        assert file.attrs["format_version"] == 1
        assert file["vertices"].dtype == np.float32
        assert file["vertices"].chunks == (1, 6, 3)


def test_batches_of_any_size_give_the_same_bytes(path, tmp_path):
    other = tmp_path / "other.h5"
    with new_mesh_sequence(other, MESH, TIME, 24.0) as sequence:
        for part in np.split(MOTION, [1, 2, 7]):
            sequence.append(part)
    assert other.read_bytes() == path.read_bytes()


def test_memory_does_not_grow_with_the_frames(tmp_path):
    mesh = Mesh(np.zeros((2000, 3)), MESH.faces)
    frames = 1000
    one = np.zeros(mesh.vertices.shape)

    def fetch(rows):
        return np.broadcast_to(one, (len(rows), *one.shape))

    sequence = MeshSequence(mesh, np.arange(frames) / 30, fetch)
    tracemalloc.start()
    write_mesh_sequence(sequence, tmp_path / "long.h5")
    with open_mesh_sequence(tmp_path / "long.h5") as stored:
        assert sum(len(batch) for batch in stored.batches()) == frames
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 0.3 * frames * one.nbytes


def test_a_sequence_cut_short_leaves_no_file(tmp_path):
    def write_half(stop):
        with new_mesh_sequence(tmp_path / "face.h5", MESH, TIME, 30.0) as sequence:
            sequence.append(MOTION[:4])
            stop()

    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half(interrupt)
    with pytest.raises(ValueError, match="4 frames written of 10"):
        write_half(lambda: None)
    assert not list(tmp_path.iterdir())


def test_more_frames_than_announced_or_of_another_mesh_are_a_mistake(tmp_path):
    for frames in (np.concatenate([MOTION, MOTION]), MOTION[:, :5]):
        with (
            pytest.raises(ValueError, match="rows"),
            new_mesh_sequence(tmp_path / "face.h5", MESH, TIME, 30.0) as sequence,
        ):
            sequence.append(frames)


def test_an_existing_file_is_kept(path):
    before = path.read_bytes()
    with pytest.raises(OutputExistsError), new_mesh_sequence(path, MESH, TIME, 30.0):
        pass
    assert path.read_bytes() == before


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e39])
def test_a_vertex_nowhere_is_refused_with_its_frame(tmp_path, value):
    lost = MOTION.copy()
    lost[7, 2, 1] = value
    with (
        pytest.raises(InputError, match="frame 7"),
        new_mesh_sequence(tmp_path / "face.h5", MESH, TIME, 30.0) as sequence,
    ):
        sequence.append(lost)


def test_time_must_rise(tmp_path):
    with (
        pytest.raises(InputError, match="/time"),
        new_mesh_sequence(tmp_path / "face.h5", MESH, TIME[::-1], 30.0),
    ):
        pass


def nan_frame(file):
    file["vertices"][3] = np.nan


def other_vertices(file):
    del file["neutral"], file["colours"]
    file["neutral"] = np.zeros((7, 3))


def shape_bomb(file):
    del file["vertices"]
    file.create_dataset("vertices", (10, MAX_VALUES, 3), "f4", chunks=(1, 1024, 3))


def frame_bomb(file):
    del file["vertices"]
    file.create_dataset("vertices", (10**9, 6, 3), "f4", chunks=(1, 6, 3))


def chunk_bomb(file):
    del file["vertices"]
    chunks = (MAX_VALUES // 18 + 1, 6, 3)  # more was not to be written before HDF5 2
    file.create_dataset("vertices", (10, 6, 3), "f4", chunks=chunks, maxshape=(None,) * 3)


def link(file):
    del file["vertices"]
    file["vertices"] = h5py.SoftLink("/neutral")


def text(file):
    del file["vertices"]
    file["vertices"] = ["one"]


def a_number(file):
    del file["vertices"]
    file["vertices"] = 3.0


def no_rate(file):
    del file.attrs["fps"]


def take(file):
    file.attrs["format"] = "facert-take"


BROKEN = [
    (nan_frame, "/vertices: expected finite numbers, found NaN or infinity in frame 3"),
    (other_vertices, r"/vertices: expected shape \(10, 7, 3\)"),
    (shape_bomb, "/vertices: expected at most"),
    (frame_bomb, "/vertices: expected shape"),
    (chunk_bomb, "/vertices: expected at most"),
    (link, "soft or external link"),
    (text, "/vertices: expected rows of numbers"),
    (a_number, "/vertices: expected rows of numbers"),
    (no_rate, "attribute fps"),
    (take, "attribute format"),
]


@pytest.mark.parametrize(("damage", "message"), BROKEN)
def test_a_broken_file_is_refused(path, damage, message):
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(InputError, match=message) as caught, open_mesh_sequence(path) as sequence:
        list(sequence.batches())
    assert str(caught.value).startswith(f"{path}: ")
