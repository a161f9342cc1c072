import json
import logging
from dataclasses import replace
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from facert.data.labelling import labelled
from facert.data.names import ARKIT_SHAPES
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError, OutputExistsError
from facert.io import formats
from facert.io.gltf.writer import write_glb
from facert.io.poses import read_poses
from facert.io.registry import require_output
from facert.mesh.morphs import rig_morphs

TAKE = Take(time=[0.0, 0.5], source=Source(np.array([[0.0], [1.0]]), ["jawOpen"]), fps=2.0)
RIG = Rig(np.eye(3), np.ones((1, 3, 3)), ("jawOpen",), np.array([[0, 1, 2]]))


@pytest.mark.parametrize(
    "name", ["take.h5", "take.HDF5", "take.csv", "take.livelink.csv", "a.json"]
)
def test_the_ending_decides_the_format_of_a_take(tmp_path, name):
    path = tmp_path / name
    formats.write_take_file(TAKE, path)
    read = formats.read_take_file(path)
    np.testing.assert_array_equal(read.time, TAKE.time)
    column = read.source.names.index("jawOpen")
    np.testing.assert_array_equal(read.source.values[:, column], [0.0, 1.0])
    assert path.read_bytes().startswith(b"Timecode") == name.endswith(".livelink.csv")


def test_hdf5_and_npz_files_hold_takes_or_rigs(tmp_path):
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
    with pytest.raises(InputError, match=r"\.h5, \.hdf5"):
        formats.write_rig_file(RIG, path)
    assert not path.exists()
    with pytest.raises(InputError, match="found nothing"):
        formats.read_any(path)
    path.write_text("")
    with pytest.raises(InputError, match=r"\.npz"):
        formats.read_any(path)


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("face.fbx", "Export it as .glb"),
        ("face.mp4", "Track the face first"),
        ("face.safetensors", "This is a model"),
        ("face.usda", "export a .glb"),
        ("face.obj", "Give the folder"),
        ("face.dat", "Export it in one of these formats"),
    ],
)
def test_a_file_of_another_kind_gets_advice(tmp_path, name, advice):
    (tmp_path / name).write_text("x")
    with pytest.raises(InputError, match=advice) as caught:
        formats.read_take_file(tmp_path / name)
    assert "Rename" not in str(caught.value)


def write_c3d(path):
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [50.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["a"]
    file["data"]["points"] = np.ones((4, 1, 3))
    file.write(str(path))


TEXTS = {
    "a.csv": "time,a\n0,1\n0.02,1\n0.04,1\n",
    "a.json": json.dumps({"fps": 50, "names": ["a"], "weights": [[1]] * 3}),
    "a.txt": "bs,a\n" + "".join(f"k,{20 * i},0,0,0,0,0,0,0,0,0,0,1\n" for i in range(3)),
    "a.trc": "PathFileType\t4\nDataRate\n50\nFrame#\tTime\ta\n\n"
    + "".join(f"{i}\t{i / 50}\t1\t1\t1\n" for i in range(3)),
}


@pytest.mark.parametrize("name", [*TEXTS, "a.c3d", "a.glb"])
def test_the_same_performance_comes_out_of_every_format(tmp_path, name):
    path = tmp_path / name
    if name in TEXTS:
        path.write_text(TEXTS[name])
    elif name == "a.c3d":
        write_c3d(path)
    else:
        rig = Rig(np.eye(3), np.ones((1, 3, 3)), ("a",), np.array([[0, 1, 2]]))
        write_glb(rig_morphs(rig, np.ones((3, 1)), np.arange(3) / 50), path)
    take = formats.read_take_file(path)
    assert (take.source.names, take.fps) == (("a",), 50.0)
    np.testing.assert_allclose(take.time, [0, 0.02, 0.04], atol=1e-8)
    np.testing.assert_array_equal(take.source.matrix, np.ones((3, take.source.matrix.shape[1])))


def test_of_a_glb_with_both_each_reader_gets_its_own(tmp_path, caplog):
    caplog.set_level(logging.INFO, "facert")
    write_glb(rig_morphs(RIG, np.ones((2, 1)), np.arange(2.0)), tmp_path / "face.glb")
    assert formats.read_rig_file(tmp_path / "face.glb").names == ("jawOpen",)
    assert formats.read_take_file(tmp_path / "face.glb").source.names == ("jawOpen",)
    assert not caplog.records
    assert isinstance(formats.read_any(tmp_path / "face.glb"), Rig)
    assert "its animation is a take as well" in caplog.text


@pytest.mark.parametrize("name", ["a.csv", "a.json"])
def test_a_few_poses_without_their_recording_come_with_a_way_back(
    make_take, tmp_path, name, caplog
):
    take = make_take(frames=30, posed=4)
    formats.write_take_file(take, tmp_path / name)
    assert f"{name} holds 4 poses and not what was recorded" in caplog.text
    # As in the warning, the two together are what was there before.
    back = labelled(replace(take, params=None, animation=None), read_poses(tmp_path / name))
    np.testing.assert_array_equal(back.labels, take.labels)
    np.testing.assert_allclose(back.params, take.params, atol=1e-9)


def test_a_few_poses_for_live_link_lose_their_frames_with_a_warning(make_take, tmp_path, caplog):
    take = replace(make_take(frames=30, posed=4), controls=Controls(ARKIT_SHAPES[:4]))
    formats.write_take_file(take, tmp_path / "a.livelink.csv")
    assert "only a .csv, .json or .h5 keeps which frames they belong to" in caplog.text


@pytest.mark.parametrize("posed", [0, 30])
def test_a_file_of_one_matrix_that_is_whole_needs_no_word(make_take, tmp_path, posed, caplog):
    formats.write_take_file(make_take(frames=30, posed=posed), tmp_path / "a.csv")
    formats.write_take_file(make_take(frames=30, posed=4), tmp_path / "a.h5")
    assert not caplog.records


def test_an_output_is_refused_before_any_work(tmp_path):
    formats.write_take_file(TAKE, tmp_path / "there.h5")
    with pytest.raises(OutputExistsError, match=r"there\.h5"):
        require_output(tmp_path / "there.h5", False, "take")
    with pytest.raises(InputError, match=r"\.livelink\.csv, .*\.csv, \.json, found '\.glb'"):
        require_output(tmp_path / "a.glb", True, "take")
    require_output(tmp_path / "there.h5", True, "take")
    (tmp_path / "folder.h5").mkdir()
    with pytest.raises(OutputExistsError, match=r"folder\.h5"):
        require_output(tmp_path / "folder.h5", False, "take")


@pytest.mark.parametrize("name", ["take.h5", "take.csv", "take.json"])
def test_a_target_of_a_take_that_has_no_targets_is_refused(tmp_path, name):
    path = tmp_path / name
    formats.write_take_file(TAKE, path)
    for read in (formats.read_take_file, formats.read_source_file):
        with pytest.raises(InputError, match=r"take\.\w+: --target: expected .* Leave it out"):
            read(path, "nonsense")


def test_of_several_takes_those_get_the_target_that_can_have_one():
    track, take = Path("truth.npz"), Path("take.h5")
    assert formats.targets_for("mine", take, track, None) == [None, "mine", None]
    assert formats.targets_for("mine", take, take) == ["mine", "mine"]  # reading refuses it
    assert formats.targets_for(None, take, track) == [None, None]
