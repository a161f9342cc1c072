import h5py
import numpy as np
import pytest

from facert.io.formats import read_rig_file, read_take_file

LIVELINK = "Timecode,BlendShapeCount,JawOpen,MouthSmile_L\n"
ROWS = "01:00:00:00.000,2,0.1,0.2\n01:00:00:02.000,0\n01:00:00:04.000,2,0.3,0.4\n"


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "face.csv"
    path.write_text(LIVELINK + ROWS)
    return path


def test_a_recording_becomes_a_take_and_comes_back(facert, recording, tmp_path):
    done = facert("convert", recording, tmp_path / "take.h5")
    assert done.code == 0
    assert "2 frames of 2 weights" in done.out
    assert "dropped 1 of 3 rows without a face" in " ".join(done.err.split())
    assert read_take_file(tmp_path / "take.h5").source.names == ("jawOpen", "mouthSmileLeft")
    assert facert("convert", tmp_path / "take.h5", tmp_path / "back.livelink.csv").code == 0
    again = read_take_file(tmp_path / "back.livelink.csv")
    assert again.start_timecode == "01:00:00:00.000"
    assert facert("convert", tmp_path / "take.h5", tmp_path / "table.csv").code == 0
    assert (tmp_path / "table.csv").read_text().startswith("time,jawOpen,mouthSmileLeft\n0,0.1,")


def test_a_track_is_converted_with_the_target_and_the_unit_that_are_asked_for(facert, tmp_path):
    one, two = np.zeros((2, 1)), np.ones((2, 1))
    targets = {"one": one, "one_names": ["a"], "two": two, "two_names": ["b"]}
    np.savez(tmp_path / "track.npz", positions=np.zeros((2, 1, 3)), names=["m"], **targets)
    arguments = ("convert", tmp_path / "track.npz", tmp_path / "take.h5")
    failed = facert(*arguments)
    assert failed.code == 3
    assert "fps" in failed.err
    failed = facert(*arguments, "--fps", "50")
    assert failed.code == 3
    assert "one of: one, two" in failed.err
    assert facert(*arguments, "--fps", "50", "--target", "two", "--units", "mm").code == 0
    take = read_take_file(tmp_path / "take.h5")
    assert (take.controls.names, take.fps, take.units) == (("b",), 50.0, "mm")


def test_meshes_become_a_rig(facert, tmp_path):
    folder = tmp_path / "meshes"
    folder.mkdir()
    for name in ("neutral", "smile"):
        (folder / f"{name}.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = facert("convert", folder, tmp_path / "rig.h5")
    assert "3 vertices and 1 shapes" in done.out
    assert read_rig_file(tmp_path / "rig.h5").names == ("smile",)


def test_an_existing_output_needs_overwrite(facert, recording, tmp_path):
    output = tmp_path / "take.h5"
    output.write_text("precious")
    refused = facert("convert", recording, output)
    assert refused.code == 2
    assert "--overwrite" in refused.err
    assert output.read_text() == "precious"
    assert facert("convert", recording, output, "--overwrite").code == 0
    assert len(read_take_file(output)) == 2


def broken_row(path):
    path.write_text(f"{LIVELINK}01:00:00:00.000,2,0.1,oops\n")
    return "line 2, column MouthSmile_L"


def truncated(path):
    with h5py.File(path, "w") as file:
        file["/time"] = np.arange(1000.0)
    path.write_bytes(path.read_bytes()[:3000])
    return "truncated"


def external_link(path):
    with h5py.File(path, "w") as file:
        file.attrs.update(format="facert-take", format_version=1, fps=30.0)
        file["/time"] = h5py.ExternalLink("elsewhere.h5", "/time")
    return "/time: expected data in the file itself"


def never_observed(path):
    with h5py.File(path, "w") as file:
        file.attrs.update(format="facert-take", format_version=1, fps=30.0)
        file["/time"] = [0.0, 1.0]
        file["/source/weights"] = np.full((2, 1), np.nan)
        file["/source/names"] = ["a"]
    return "/source/weights: expected at least one observed value"


@pytest.mark.parametrize(
    ("make", "name"),
    [(broken_row, "a.csv"), (truncated, "a.h5"), (external_link, "a.h5"), (never_observed, "a.h5")],
)
def test_bad_input_gets_one_line_and_no_output(facert, tmp_path, make, name):
    message = make(tmp_path / name)
    failed = facert("convert", tmp_path / name, tmp_path / "out.h5")
    assert failed.code == 3
    assert failed.out == ""
    assert len(failed.err.splitlines()) == 1
    assert f"{tmp_path / name}: " in failed.err
    assert message in failed.err
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_the_unit_that_is_asked_for_replaces_the_one_of_the_file(facert, recording, tmp_path):
    facert("convert", recording, tmp_path / "one.h5", "--units", "cm")
    facert("convert", tmp_path / "one.h5", tmp_path / "two.h5", "--units", "mm")
    assert read_take_file(tmp_path / "two.h5").units == "mm"
