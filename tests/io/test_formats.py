import numpy as np
import pytest

from facert.data import Rig, Source, Take
from facert.errors import InputError
from facert.io import formats

TAKE = Take(time=[0.0, 0.5], source=Source(np.array([[0.0], [1.0]]), ["jawOpen"]), fps=2.0)
RIG = Rig(np.eye(3), np.ones((1, 3, 3)), ("jawOpen",), np.array([[0, 1, 2]]))


@pytest.mark.parametrize("name", ["take.h5", "take.HDF5", "take.csv", "take.livelink.csv"])
def test_the_ending_tells_the_format_of_a_take(tmp_path, name):
    path = tmp_path / name
    formats.write_take_file(TAKE, path)
    read = formats.read_take_file(path)
    np.testing.assert_array_equal(read.time, TAKE.time)
    column = read.source.names.index("jawOpen")
    np.testing.assert_array_equal(read.source.values[:, column], [0.0, 1.0])
    assert path.read_bytes().startswith(b"Timecode") == name.endswith(".livelink.csv")


def test_hdf5_and_npz_files_tell_takes_from_rigs(tmp_path):
    formats.write_rig_file(RIG, tmp_path / "rig.h5")
    formats.write_take_file(TAKE, tmp_path / "take.h5")
    np.savez(tmp_path / "rig.npz", neutral=RIG.neutral, faces=RIG.faces, deltas=RIG.shapes,
             names=["jawOpen"])  # fmt: skip
    assert isinstance(formats.read_any(tmp_path / "rig.h5"), Rig)
    assert isinstance(formats.read_any(tmp_path / "rig.npz"), Rig)
    assert isinstance(formats.read_any(tmp_path / "take.h5"), Take)
    with pytest.raises(InputError, match="expected a take, found a rig"):
        formats.read_take_file(tmp_path / "rig.h5")
    with pytest.raises(InputError, match="expected a rig, found a take"):
        formats.read_rig_file(tmp_path / "take.h5")


def test_a_folder_is_a_rig_of_meshes(tmp_path):
    for name in ("neutral", "smile"):
        (tmp_path / f"{name}.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert formats.read_rig_file(tmp_path).names == ("smile",)


@pytest.mark.parametrize("name", ["take.fbx", "take"])
def test_an_unknown_ending_is_refused_with_those_that_are_known(tmp_path, name):
    path = tmp_path / name
    with pytest.raises(InputError, match=r"\.livelink\.csv"):
        formats.write_take_file(TAKE, path)
    with pytest.raises(InputError, match=r"\.h5 or \.hdf5"):
        formats.write_rig_file(RIG, path)
    assert not path.exists()
    with pytest.raises(InputError, match="found nothing"):
        formats.read_any(path)
    path.write_text("")
    with pytest.raises(InputError, match=r"\.npz"):
        formats.read_any(path)
