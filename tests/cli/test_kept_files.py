"""No command replaces a file that facert did not write; inputs are looked at before outputs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import facert as package
from facert.data.rig import Rig
from facert.io.formats import write_rig_file
from facert.settings import Settings

CSV = b"time,jawOpen,mouthClose\n0,0.1,0.2\n0.5,0.3,0.4\n1,0.5,0.6\n"
KEPT = "the file was not written by facert: it is never replaced. Give another name, or delete it"
SWAPPED = "Are the arguments swapped?"


@pytest.fixture(name="folder", scope="module")
def _folder(make_take, tmp_path_factory) -> Path:
    """A take with a few poses, one with all, a result of it, a model, a rig, and recordings."""
    folder = tmp_path_factory.mktemp("kept")
    take, posed = make_take(frames=40), make_take(frames=40, posed=40, animation=0)
    package.write_take(take, folder / "take.h5")
    package.write_take(posed, folder / "posed.h5")
    package.write_take(replace(posed, std=np.full((40, 4), 0.1)), folder / "result.h5")
    package.train(posed, Settings(method="ridge")).save(folder / "model.safetensors")
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.1], [0.0, 1.0, 0.0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    write_rig_file(Rig(square, np.ones((2, 4, 3)), ("jawOpen", "mouthClose"), triangles, "cm"),
                   folder / "rig.h5")  # fmt: skip
    (folder / "in.csv").write_bytes(CSV)
    (folder / "points.csv").write_text("time,v0.x,v0.y,v0.z,v2.x,v2.y,v2.z\n0,0,0,0,1,1,0.1\n"
                                       "0.1,0,0,0,1,1,0.2\n")  # fmt: skip
    return folder


COMMANDS = {
    "convert": ("kept.csv", ("convert", "take.h5", "kept.csv")),
    "convert to json": ("kept.json", ("convert", "take.h5", "kept.json")),
    "convert a rig": ("kept.glb", ("convert", "rig.h5", "kept.glb")),
    "retarget": ("kept.csv", ("retarget", "take.h5", "kept.csv", "-m", "model.safetensors")),
    "train": ("kept.safetensors", ("train", "posed.h5", "--method", "ridge", "-o",
                                   "kept.safetensors")),
    "train --log": ("kept.csv", ("train", "take.h5", "-o", "new.safetensors", "--log", "kept.csv",
                                 "--method", "ssgplvm")),
    "pose": ("kept.csv", ("pose", "--poses", "posed.h5", "--set", "jaw=0.1", "-o", "kept.csv")),
    "pose json": ("kept.json", ("pose", "--poses", "posed.h5", "--set", "jaw=0.1", "-o",
                                "kept.json")),
    "clean": ("kept.h5", ("clean", "take.h5", "kept.h5")),
    "stabilise": ("kept.h5", ("stabilise", "take.h5", "kept.h5")),
    "propagate": ("kept.h5", ("propagate", "take.h5", "kept.h5")),
    "drive": ("kept.glb", ("drive", "rig.h5", "points.csv", "kept.glb")),
    "simulate": ("kept.csv", ("simulate", "rig.h5", "in.csv", "kept.csv", "--markers", "2")),
    "live": ("kept.csv", ("live", "--in", "take:take.h5", "-m", "model.safetensors", "--out",
                          "csv:kept.csv")),
    "live --record": ("kept.h5", ("live", "--in", "take:take.h5", "-m", "model.safetensors",
                                  "--out", "h5:new.h5", "--record", "kept.h5")),
    "demo": ("training.h5", ("demo", ".")),
    "eval": ("kept.json", ("eval", "posed.h5", "--methods", "ridge", "--repeats", "1",
                           "--jobs", "1", "--json", "kept.json")),
    "eval over a c3d": ("kept.c3d", ("eval", "posed.h5", "--json", "kept.c3d")),
    "export-script": ("kept.csv", ("export-script", "maya", "-o", "kept.csv")),
}  # fmt: skip


@pytest.mark.parametrize("options", [(), ("--overwrite",)], ids=["", "overwrite"])
@pytest.mark.parametrize("case", COMMANDS)
def test_every_command_keeps_it(facert, folder, monkeypatch, case, options) -> None:
    monkeypatch.chdir(folder)
    name, arguments = COMMANDS[case]
    kept, content = folder / name, b"somebody's" if name != "kept.csv" else CSV
    kept.write_bytes(content)
    before = sorted(folder.iterdir())
    refused = facert(*arguments, *options)
    assert refused.code == 3, refused
    assert f"{name}: {KEPT}" in " ".join(refused.err.split())
    assert "--overwrite" not in refused.err
    assert kept.read_bytes() == content
    assert sorted(folder.iterdir()) == before
    kept.unlink()


OWN = ["convert", "convert to json", "convert a rig", "pose json", "drive", "eval", "train"]


@pytest.mark.parametrize("case", OWN)
def test_what_the_same_command_wrote_is_replaced(facert, folder, monkeypatch, case) -> None:
    monkeypatch.chdir(folder)
    name, arguments = COMMANDS[case]
    assert facert(*arguments).code == 0
    refused = facert(*arguments)
    assert refused.code == 2
    assert "--overwrite" in refused.err
    assert facert(*arguments, "--overwrite").code == 0
    (folder / name).unlink()


def test_a_take_of_another_program_is_kept(facert, folder, tmp_path) -> None:
    other = tmp_path / "other.h5"
    other.write_bytes((folder / "take.h5").read_bytes())
    with h5py.File(other, "r+") as file:
        file.attrs["created_by"] = "tracker 2"
    before = other.read_bytes()
    assert facert("convert", folder / "take.h5", other, "--overwrite").code == 3
    assert other.read_bytes() == before


def test_one_of_many_that_is_kept_does_not_stop_the_others(facert, folder, tmp_path) -> None:
    (tmp_path / "take.csv").write_bytes(CSV)
    takes = (folder / "take.h5", folder / "posed.h5")
    for options in ((), ("--overwrite",)):
        done = facert("convert", *takes, "--out-dir", tmp_path, "--ending", ".csv", *options)
        assert done.code == 1
        assert f"failed  {takes[0]}: {tmp_path / 'take.csv'}: {KEPT}" in done.out
        assert "1 of 2 files failed" in done.err
        assert (tmp_path / "posed.csv").exists()
        assert (tmp_path / "take.csv").read_bytes() == CSV


MISSING = [
    ("convert", "none.h5", "out.h5"),
    ("clean", "none.h5", "out.h5"),
    ("retarget", "none.h5", "out.h5"),
    ("stabilise", "none.h5", "out.h5"),
    ("propagate", "none.h5", "out.h5"),
    ("simulate", "rig.h5", "none.csv", "out.h5"),
    ("drive", "rig.h5", "none.csv", "out.h5"),
    ("train", "none.h5", "-o", "model.safetensors"),
    ("eval", "none.h5", "--json", "out.h5"),
    ("plot", "none.h5", "out.png"),
    ("render", "none.h5", "out.png"),
    ("report", "none.h5", "-o", "out.html"),
    ("suggest", "none.h5", "--sheet", "out.png"),
    ("points", "suggest", "none.h5", "--picture", "out.png"),
    ("pose", "--poses", "none.h5", "--set", "jaw=0.1", "-o", "out.h5"),
]


@pytest.mark.parametrize("arguments", MISSING, ids=lambda given: given[0])
def test_a_missing_input_is_named_before_an_output_that_exists(
    facert, folder, monkeypatch, tmp_path, arguments
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("rig.h5", "model.safetensors"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "out.h5").write_bytes((folder / "result.h5").read_bytes())
    for name in ("out.png", "out.html"):
        (tmp_path / name).write_bytes(b"mine")
    refused = facert(*arguments)
    assert refused.code == 3
    assert "none." in refused.err
    assert "an existing file, found nothing" in refused.err
    assert "exists" not in refused.err
    assert SWAPPED not in refused.err


@pytest.mark.parametrize("command", ["retarget", "convert", "clean", "stabilise", "propagate"])
@pytest.mark.parametrize("options", [(), ("--overwrite",)], ids=["", "overwrite"])
def test_swapped_arguments_are_asked_about(facert, folder, tmp_path, command, options) -> None:
    recordings = {"phone.csv": CSV, "take.h5": (folder / "take.h5").read_bytes()}
    for name, content in recordings.items():
        recording = tmp_path / name
        recording.write_bytes(content)
        missing = facert(command, tmp_path / "none.h5", recording, *options)
        assert missing.code == 3
        assert "none.h5: file: expected an existing file, found nothing" in missing.err
        assert missing.err.strip().endswith(SWAPPED)
        result = facert(command, folder / "result.h5", recording, *options)
        assert result.code == 3
        assert f"{name}: the file" in result.err
        assert result.err.strip().endswith(f"delete it yourself. {SWAPPED}")
        assert recording.read_bytes() == content


def test_so_are_tables_and_recordings_that_are_never_written(facert, folder, tmp_path) -> None:
    table, phone, markers = (tmp_path / name for name in ("out.csv", "phone.csv", "take.c3d"))
    assert facert("convert", folder / "result.h5", table).code == 0
    phone.write_bytes(CSV)
    markers.write_bytes(b"c3d")
    for recording in (phone, markers):
        for source in (table, tmp_path / "none.h5"):
            refused = facert("retarget", source, recording, "--overwrite")
            assert refused.code == 3
            assert refused.err.strip().endswith(SWAPPED)


def test_results_may_be_made_anew_from_results(facert, folder, tmp_path) -> None:
    model = ("-m", folder / "model.safetensors")
    for command, more in (("retarget", model), ("convert", ()), ("clean", ())):
        out = tmp_path / f"{command}.h5"
        for options in ((), ("--overwrite",)):
            done = facert(command, folder / "result.h5", out, *more, *options)
            assert done.code == 0, done.err


def test_a_curve_that_may_not_be_written_is_refused_before_takes_are_read(
    facert, tmp_path: Path
) -> None:
    (take := tmp_path / "take.csv").write_text("time,a\nbroken")
    (curve := tmp_path / "curve.txt").write_text("somebody's")
    arguments = ("--method", "sgplvm", "-o", tmp_path / "model.safetensors", "--log", curve)
    refused = facert("train", take, *arguments, "--overwrite")
    assert refused.code == 3
    assert "curve.txt: the file was not written by facert" in refused.err
