import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facert as api
from facert.data.take import Source, Take
from facert.io.take import read_take
from facert.mesh.rigid import RigidMotion

NAMES = tuple(f"m{i}" for i in range(8))


@pytest.fixture
def files(tmp_path):
    """A take with head motion, the same without, and where to write."""
    rng, time = np.random.default_rng(0), np.arange(90) / 30.0
    still = np.repeat(5.0 * rng.normal(size=(1, 8, 3)), 90, axis=0)
    still[:, 5:] += np.sin(4.0 * time)[:, None, None] * rng.normal(size=(3, 3))
    still += 1e-3 * rng.normal(size=still.shape)
    turn = Rotation.from_rotvec(0.2 * np.sin(time)[:, None] * [1.0, 0.5, 0.2]).as_matrix()
    moved = RigidMotion(turn, np.sin(time)[:, None] * [2.0, 1.0, 0.0]).apply(still)
    write(tmp_path / "in.h5", moved)
    return tmp_path / "in.h5", still, moved, tmp_path / "out.h5"


def write(path, markers):
    take = Take(np.arange(len(markers)) / 30.0, Source(markers, NAMES), units="cm")
    api.write_take(take, path, overwrite=True)


def test_what_was_removed_is_printed_and_kept(facert, files):
    take, still, moved, output = files
    done = facert("stabilise", take, output, "--stable", "m0, m1,M2,m3,m4", "--reference", "0")
    assert done.code == 0, done.err
    assert "degrees RMS" in done.out
    assert "cm at most" in done.out
    assert "stable markers: m0, m1, m2, m3, m4" in done.out
    found = read_take(output)
    np.testing.assert_allclose(found.source.values, still, atol=0.02)
    with h5py.File(output) as file:
        head = file["source/head"][()]
    homogeneous = np.concatenate([found.source.values, np.ones((90, 8, 1))], axis=2)
    back = homogeneous @ head.transpose(0, 2, 1)
    np.testing.assert_allclose(back[:, :, :3], moved, atol=1e-9)


def test_stable_markers_are_found_automatically(facert, files):
    take, _, _, output = files
    done = facert("stabilise", take, output)
    assert done.code == 0, done.err
    assert "stable markers: m0, m1, m2, m3, m4\n" in done.out


def test_bad_markers_are_not_observed_unless_asked_for(facert, files):
    take, _, moved, output = files
    moved[30:50, 1] = 0.0
    write(take, moved)
    done = facert("stabilise", take, output)
    assert "20 zero" in done.err
    np.testing.assert_array_equal(np.isnan(read_take(output).source.values[30:50, 1]), True)
    done = facert("stabilise", take, output, "--no-detect", "--overwrite")
    assert "zero" not in done.err
    assert read_take(output).source.valid.all()


def test_frames_that_show_too_few_are_counted(facert, files):
    take, _, moved, output = files
    moved[30:34, :3] = np.nan
    write(take, moved)
    done = facert("stabilise", take, output, "--stable", "m0,m1,m2,m3")
    assert "in 4 frames with fewer than three stable markers" in done.err


@pytest.mark.parametrize(
    ("options", "code", "word"),
    [
        (("--stable", "m0,m1,Fred"), 3, "Fred"),
        (("--stable", "m0"), 3, "three markers"),
        (("--reference", "90"), 3, "0 to 89"),
        (("--reference", "last"), 3, "a frame or mean"),
    ],
)
def test_bad_options_are_named_and_nothing_is_written(facert, files, options, code, word):
    take, _, _, output = files
    done = facert("stabilise", take, output, *options)
    assert done.code == code
    assert word in done.err
    assert not output.exists()


def test_an_existing_file_is_kept(facert, files):
    take, _, _, _ = files
    assert facert("stabilise", take, take).code == 2


def test_a_table_holds_the_markers_alone(facert, files, tmp_path):
    take, _, _, _ = files
    done = facert("stabilise", take, tmp_path / "out.csv")
    assert done.code == 0, done.err
    assert "/source/head" in done.err
    assert api.read_take(tmp_path / "out.csv").source.values.shape == (90, 8, 3)


def test_a_second_take_gets_the_head_pose_of_the_first(facert, files, tmp_path):
    take, _, moved, output = files
    write(tmp_path / "second.h5", moved[45:])
    assert facert("stabilise", take, output, "--stable", "m0,m1,m2,m3,m4").code == 0
    second, stable = tmp_path / "steady.h5", ("--stable", "m0,m1,m2,m3,m4")
    done = facert("stabilise", tmp_path / "second.h5", second, *stable, "--like", output)
    assert done.code == 0, done.err
    first, other = (read_take(path).source.values for path in (output, second))
    np.testing.assert_allclose(other, first[45:], atol=0.05)
    both = facert("stabilise", take, second, "--like", output, "--reference", "0", "--overwrite")
    assert both.code == 2
