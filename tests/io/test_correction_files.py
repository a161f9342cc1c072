from dataclasses import replace

import h5py
import numpy as np
import pytest

from facert.data.corrections import put_in, taken_out
from facert.data.take import Controls, Corrections, Source, Take
from facert.errors import InputError
from facert.io.take import read_take, write_take


def result(std=True):
    values = np.random.default_rng(0).random((8, 2))
    return Take(
        np.arange(8) / 30,
        Source(values, ["a", "b"]),
        Controls(["x", "y"]),
        values / 2,
        np.full((8, 2), 0.1) if std else None,
    )


def corrected(std=True):
    poses = np.array([[0.3, 0.1], [0.2, 0.4]])
    return put_in(result(std), Corrections(np.array([2, 5]), poses, np.array([0.1, 0.5])))


@pytest.mark.parametrize("std", [True, False])
def test_corrections_come_back_and_can_be_taken_back(tmp_path, std):
    shot, path = corrected(std), tmp_path / "shot.h5"
    write_take(shot, path)
    read = read_take(path)
    np.testing.assert_array_equal(read.params, shot.params)
    for name in ("frames", "params", "width", "predicted", "std"):
        expected = getattr(shot.corrections, name)
        found = getattr(read.corrections, name)
        assert (found is None) == (expected is None)
        if found is not None:
            np.testing.assert_array_equal(found, expected)
    assert (taken_out(read).params == result().params).all()


def test_facert_without_corrections_refuses_such_a_file_and_reads_every_other(tmp_path):
    for take, version in ((corrected(), 2), (result(), 1), (taken_out(corrected()), 1)):
        path = tmp_path / "take.h5"
        write_take(take, path, overwrite=True)
        with h5py.File(path) as file:
            assert file.attrs["format_version"] == version
            assert ("corrections" in file) == (version == 2)


@pytest.mark.parametrize(
    ("name", "value", "match"),
    [
        ("frames", np.array([2, 8]), "/corrections/frames: expected frames of the take, 0 to 7"),
        ("frames", np.array([-1, 5]), "/corrections/frames"),
        ("frames", np.array([5, 2]), "/corrections/frames: expected rising"),
        ("frames", np.array([[2, 5]]), "/corrections/frames"),
        ("frames", np.array([2.0, 5.0]), "/corrections/frames"),
        ("frames", np.array([2, 2**62]), "/corrections/frames"),
        ("width", np.array([0.1, np.nan]), "/corrections/width: expected seconds from 0"),
        ("width", np.array([0.1, 0.5, 0.5]), "/corrections/width"),
        ("width", None, "/corrections/width"),
        ("predicted", np.zeros((8, 3)), "/corrections/predicted"),
        ("predicted", np.zeros((7, 2)), "/corrections/predicted"),
        ("predicted", np.full((8, 2), np.inf), "/corrections/predicted"),
        ("std", np.zeros((8, 1)), "/corrections/std"),
    ],
)
def test_damaged_corrections_are_named_with_their_file(tmp_path, name, value, match):
    path = tmp_path / "shot.h5"
    write_take(corrected(), path)
    with h5py.File(path, "a") as file:
        del file["corrections"][name]
        if value is not None:
            file["corrections"][name] = value
    with pytest.raises(InputError, match=match) as caught:
        read_take(path)
    assert caught.value.where == str(path)


def test_a_correction_in_a_frame_without_a_pose_is_refused(tmp_path):
    path = tmp_path / "shot.h5"
    write_take(corrected(), path)
    with h5py.File(path, "a") as file:
        file["target/params"][2] = np.nan
    with pytest.raises(InputError, match="/corrections/params: expected finite"):
        read_take(path)


def test_corrections_without_poses_are_refused():
    with pytest.raises(InputError, match="/corrections/frames"):
        replace(corrected(), params=None, std=None)
