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
    assert (tmp_path / "table.csv").read_text().startswith('"time",jawOpen,mouthSmileLeft\n0,0.1,')


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
    assert "3 vertices and 1 shape" in done.out
    assert read_rig_file(tmp_path / "rig.h5").names == ("smile",)


def test_shapes_that_stand_beside_the_neutral_are_named_and_moved_back(facert, tmp_path):
    folder = tmp_path / "meshes"
    folder.mkdir()
    places = {"neutral": (0, 0), "jawOpen": (0, -0.5), "smile": (20, 0), "pucker": (20, -0.2)}
    for name, (right, low) in places.items():
        corners = [(0, low), (2, low), (0, 1), (2, 1), (1, 2)]
        lines = [f"v {x + right} {y} 0" for x, y in corners]
        (folder / f"{name}.obj").write_text("\n".join([*lines, "f 1 2 4 3", "f 3 4 5"]))
    done = facert("convert", folder, tmp_path / "rig.h5")
    warning = " ".join(done.err.split())
    assert "pucker, smile move every vertex by 10 times the face's width" in warning
    assert "--align-shapes" in warning
    assert "jawOpen" not in warning
    done = facert("convert", folder, tmp_path / "mended.h5", "--align-shapes")
    assert "moved into register with the neutral: pucker, smile" in " ".join(done.err.split())
    rig = read_rig_file(tmp_path / "mended.h5")
    shapes = dict(zip(rig.names, rig.shapes, strict=True))
    np.testing.assert_allclose(shapes["smile"], 0, atol=1e-9)
    np.testing.assert_allclose(shapes["pucker"], [[0, -0.2, 0]] * 2 + [[0, 0, 0]] * 3, atol=1e-6)


def test_a_take_has_no_shapes_to_align(facert, recording, tmp_path):
    refused = facert("convert", recording, tmp_path / "take.h5", "--align-shapes")
    assert refused.code == 3
    expected = "--align-shapes: expected a folder of OBJ files, found take"
    assert expected in " ".join(refused.err.split())


def test_an_existing_output_needs_overwrite(facert, recording, tmp_path):
    output = tmp_path / "take.h5"
    assert facert("convert", recording, output).code == 0
    before = output.read_bytes()
    refused = facert("convert", recording, output, "--fps", "10")
    assert refused.code == 2
    assert "--overwrite" in refused.err
    assert output.read_bytes() == before
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


MARKERS = "time,a.x,a.y,a.z\n0,1,2,3\n0.02,1,2,4\n0.04,1,2,5\n"


@pytest.fixture
def capture(tmp_path):
    path = tmp_path / "capture.csv"
    path.write_text(MARKERS)
    return path


def test_rate_unit_and_axis_are_converted(facert, capture, tmp_path):
    space = ("--in-units", "cm", "--units", "m", "--in-up-axis", "z", "--up-axis", "y")
    output = tmp_path / "take.h5"
    assert facert("convert", capture, output, "--fps", "100", *space).code == 0
    take = read_take_file(output)
    np.testing.assert_allclose(take.time, np.arange(5) / 100)
    np.testing.assert_allclose(take.source.values[:, 0, 1], [0.03, 0.035, 0.04, 0.045, 0.05])
    np.testing.assert_allclose(take.source.values[:, 0, ::2], [[0.01, -0.02]] * 5)
    assert (take.fps, take.units, take.up_axis) == (100.0, "m", "y")
    again = facert("convert", output, tmp_path / "mm.h5", "--units", "mm", "--up-axis", "z")
    assert again.code == 0
    np.testing.assert_allclose(read_take_file(tmp_path / "mm.h5").source.values[0], [[10, 20, 30]])


def test_what_in_does_not_state_is_taken_to_be_as_asked_with_a_warning(facert, capture, tmp_path):
    done = facert("convert", capture, tmp_path / "take.h5", "--units", "cm", "--up-axis", "y")
    assert "does not say its unit: it is taken to be cm" in done.err
    assert "does not say its up axis: it is taken to be y" in done.err
    take = read_take_file(tmp_path / "take.h5")
    np.testing.assert_array_equal(take.source.values[0], [[1, 2, 3]])
    assert (take.units, take.up_axis) == ("cm", "y")


def test_frame_numbers_have_the_rate_of_in_and_out_has_its_own(facert, tmp_path):
    (tmp_path / "a.csv").write_text("frame,a\n0,1\n1,2\n2,3\n")
    facert("convert", tmp_path / "a.csv", tmp_path / "a.json", "--in-fps", "10", "--fps", "20")
    take = read_take_file(tmp_path / "a.json")
    np.testing.assert_allclose(take.time, np.arange(5) / 20)
    np.testing.assert_allclose(take.source.values[:, 0], [1, 1.5, 2, 2.5, 3])


def test_a_map_renames_strictly(facert, recording, tmp_path):
    names = tmp_path / "names.toml"
    names.write_text('jaw-open = "Kiefer"\n')
    assert facert("convert", recording, tmp_path / "a.h5", "--map", names).code == 0
    assert read_take_file(tmp_path / "a.h5").source.names == ("Kiefer", "mouthSmileLeft")
    names.write_text('jawOpne = "Kiefer"\n')
    refused = facert("convert", recording, tmp_path / "b.h5", "--map", names)
    assert refused.code == 3
    assert "Did you mean 'jawOpen'?" in refused.err
    assert not (tmp_path / "b.h5").exists()


def test_poses_of_another_file_become_labels(facert, capture, tmp_path):
    poses = tmp_path / "poses.csv"
    poses.write_text("frame,jaw,smile\n2,0.5,0.25\n0,0,0\n")
    done = facert("convert", capture, tmp_path / "take.h5", "--poses", poses)
    assert "3 frames of 1 marker and 2 poses" in done.out
    take = read_take_file(tmp_path / "take.h5")
    assert take.labels.tolist() == [0, 2]
    assert take.params[2].tolist() == [0.5, 0.25]
    poses.write_text("frame,jaw,smile\n3,0.5,0.25\n")
    refused = facert("convert", capture, tmp_path / "b.h5", "--poses", poses)
    assert refused.code == 3
    assert f"{poses}: column frame: expected 0 to 2, found 3" in refused.err


def test_the_start_timecode_is_set_or_refused(facert, capture, tmp_path):
    facert("convert", capture, tmp_path / "a.h5", "--start-timecode", "01:02:03:04")
    assert read_take_file(tmp_path / "a.h5").start_timecode == "01:02:03:04"
    refused = facert("convert", capture, tmp_path / "b.h5", "--start-timecode", "noon")
    assert (refused.code, "HH:MM:SS:FF" in refused.err) == (3, True)


@pytest.mark.parametrize(
    ("option", "value"), [("--fps", "30"), ("--start-timecode", "01:00:00:00")]
)
def test_a_rig_has_no_frames(facert, tmp_path, option, value):
    np.savez(tmp_path / "rig.npz", neutral=np.eye(3), faces=[[0, 1, 2]],
             deltas=np.ones((1, 3, 3)), names=["a"])  # fmt: skip
    refused = facert("convert", tmp_path / "rig.npz", tmp_path / "rig.h5", option, value)
    assert refused.code == 3
    assert f"{option}: expected a take" in refused.err
    turned = ("--in-up-axis", "z", "--up-axis", "y", "--in-units", "m", "--units", "cm")
    assert facert("convert", tmp_path / "rig.npz", tmp_path / "rig.h5", *turned).code == 0
    np.testing.assert_allclose(
        read_rig_file(tmp_path / "rig.h5").neutral, [[100, 0, 0], [0, 0, -100], [0, 100, 0]]
    )


def test_rows_of_json_are_as_many_as_moments(facert, tmp_path):
    rows = [f"10:00:00:{2 * i:02d}.000,{1 if i < 8 or i > 12 else 0},0.5" for i in range(30)]
    (tmp_path / "a.csv").write_text("\n".join([LIVELINK.split(",Mouth")[0], *rows]) + "\n")
    done = facert("convert", tmp_path / "a.csv", tmp_path / "a.json")
    assert done.code == 0
    assert "5 missing frames: held" in done.err
    assert read_take_file(tmp_path / "a.json").time.tolist() == [i / 30 for i in range(30)]
    assert facert("convert", tmp_path / "a.csv", tmp_path / "b.h5", "--fps", "30").code == 0
    take = read_take_file(tmp_path / "b.h5")
    assert (len(take), int(take.source.valid.all(axis=1).sum())) == (30, 25)


def test_the_rate_that_is_given_counts_for_a_recording_and_its_poses(facert, tmp_path):
    rows = [f"00:00:{i:02d}:00.000,1,{i / 50}" for i in range(50)]
    (tmp_path / "a.csv").write_text("\n".join([LIVELINK.split(",Mouth")[0], *rows]) + "\n")
    (tmp_path / "p.csv").write_text("\n".join(["time,jaw", "0.16,1", "0.8,0", "1.32,1"]) + "\n")
    done = facert("convert", tmp_path / "a.csv", tmp_path / "a.h5", "--in-fps", "25",
                  "--poses", tmp_path / "p.csv")  # fmt: skip
    assert done.code == 0, done.err
    take = read_take_file(tmp_path / "a.h5")
    assert (take.fps, take.time[-1], take.labels.tolist()) == (25.0, 1.96, [4, 20, 33])
    table = tmp_path / "uneven.csv"
    table.write_text("time,a\n" + "".join(f"{0.04 * i + 0.0004 * i * i},1\n" for i in range(30)))
    refused = facert("convert", table, tmp_path / "b.h5", "--in-fps", "60")
    assert refused.code == 3
    assert "--in-fps" in refused.err
