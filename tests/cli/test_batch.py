import numpy as np
import pytest

import facert as api
from facert import Settings


@pytest.fixture
def folder(make_take, tmp_path):
    """Three takes, a broken one, a note, and a model."""
    for seed in range(3):
        api.write_take(make_take(seed=seed, posed=0), tmp_path / f"take{seed}.h5")
    (tmp_path / "broken.h5").write_text("not HDF5")
    (tmp_path / "readme.md").write_text("not a take")
    api.train(make_take(), Settings(method="ridge")).save(tmp_path / "model.safetensors")
    return tmp_path


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_folder_is_done_file_by_file_and_a_bad_one_stops_none(facert, folder, jobs):
    out, model = folder / "out", folder / "model.safetensors"
    done = facert("retarget", folder, "--out-dir", out, "-m", model, "-j", jobs)
    assert done.code == 1
    assert sorted(path.name for path in out.iterdir()) == ["take0.h5", "take1.h5", "take2.h5"]
    lines = [line for line in done.out.splitlines() if line.startswith(("done", "failed"))]
    assert len(lines) == 4
    assert [line for line in lines if line.startswith("failed") and "broken.h5" in line]
    assert "1 of 4 files failed" in done.err
    again = facert("retarget", folder, "--out-dir", out, "-m", model, "-j", jobs)
    assert "1 of 4 files failed, 3 exist already" in again.err
    single = folder / "single.h5"
    assert facert("retarget", folder / "take1.h5", single, "-m", model).code == 0
    np.testing.assert_allclose(
        api.read_take(out / "take1.h5").params, api.read_take(single).params, atol=1e-10
    )


def test_what_is_there_already_is_left_alone_unless_asked_otherwise(facert, folder):
    takes, out = [folder / f"take{seed}.h5" for seed in range(3)], folder / "out"
    out.mkdir()
    before = takes[1].read_bytes()
    (out / "take1.h5").write_bytes(before)
    done = facert("clean", *takes, "--out-dir", out)
    assert done.code == 0
    assert "exists" in done.out
    assert (out / "take1.h5").read_bytes() == before
    assert facert("clean", *takes, "--out-dir", out, "--overwrite").code == 0
    assert api.read_take(out / "take1.h5").source.valid.all()


def test_convert_gives_them_all_the_ending_that_is_asked_for(facert, folder):
    done = facert("convert", folder, "--out-dir", folder / "csv", "--ending", ".csv")
    assert done.code == 1  # the broken one
    assert len(list((folder / "csv").glob("take?.csv"))) == 3


def test_two_results_of_one_name_are_refused_before_anything_is_done(facert, folder):
    other = folder / "other"
    other.mkdir()
    (other / "take0.h5").write_bytes((folder / "take0.h5").read_bytes())
    done = facert("clean", folder / "take0.h5", other / "take0.h5", "--out-dir", folder / "out")
    assert done.code == 3
    assert "two for take0.h5" in done.err
    assert not (folder / "out").exists()


def test_results_never_take_the_place_of_what_they_are_made_of(facert, folder):
    before = (folder / "take0.h5").read_bytes()
    done = facert("clean", folder, "--out-dir", folder, "--overwrite")
    assert done.code == 3
    assert (folder / "take0.h5").read_bytes() == before


def test_in_and_out_or_a_folder_for_the_results(facert, folder):
    assert facert("clean", folder / "take0.h5").code == 2
    assert facert("clean", *[folder / "take0.h5"] * 3).code == 2
    empty = folder / "empty"
    empty.mkdir()
    assert facert("clean", empty, "--out-dir", folder / "out").code == 3


@pytest.mark.parametrize("option", [("--jobs", 2), ("--ending", ".csv")])
def test_options_for_many_files_are_refused_for_one(facert, folder, option):
    done = facert("clean", folder / "take0.h5", folder / "out.h5", *option)
    assert done.code == 2
    assert f"{option[0]} is for many files" in done.err


def test_a_result_that_cannot_be_written_is_refused_before_the_takes_are_read(facert, folder):
    for command in ("clean", "retarget"):
        done = facert(command, folder / "none.h5", folder / "out.fbx")
        assert done.code == 3
        assert "out.fbx: output's ending" in done.err
    done = facert("clean", folder, "--out-dir", folder / "out", "--ending", ".fbx")
    assert done.code == 3
    assert "output's ending" in done.err
    assert not (folder / "out").exists()


def test_an_empty_file_is_one_that_fails_and_the_poses_of_a_result_are_no_truth(facert, folder):
    out, model = folder / "out", folder / "model.safetensors"
    (folder / "empty.csv").write_bytes(b"")
    (folder / "shots.csv").write_text("shot,note\n010,good\n")
    assert facert("retarget", folder / "take0.h5", folder / "shot.h5", "-m", model).code == 0
    shot = api.read_take(folder / "shot.h5")
    pose = f"{shot.controls.names[0]}={shot.params[3, 0] + 0.1}"
    change = ("--frame", 3, "--set", pose, "-m", model, "--overwrite")
    assert facert("correct", folder / "shot.h5", *change).code == 0
    done = facert("retarget", folder, "--out-dir", out, "-m", model)
    failed = [line for line in done.out.splitlines() if line.startswith("failed")]
    assert len(failed) == 2
    assert "broken.h5" in failed[0]
    assert "empty.csv" in failed[1]
    assert "shots.csv" in done.err
    assert (out / "shot.h5").exists()
    assert "RMS" not in done.out
