"""``facert render`` as a user calls it: sheets and clips of takes and of mesh sequences."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from facert.data.rig import MeshSequence, Rig
from facert.data.take import Controls, Source, Take
from facert.io.mesh_sequence import write_mesh_sequence
from facert.io.rig import write_rig
from facert.io.take import write_take

VERTICES = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
RIG = Rig(VERTICES, VERTICES[None] * 0.5, ("up",), np.array([[0, 1, 2], [0, 2, 3]]))
PARAMS = np.sin(np.linspace(0, 3, 24))[:, None]


@pytest.fixture(name="folder")
def _folder(tmp_path: Path) -> Path:
    write_rig(RIG, tmp_path / "rig.h5")
    time = np.arange(24) / 24
    markers = Source(np.random.default_rng(0).normal(size=(24, 3, 3)), ("a", "b", "c"))
    take = Take(time=time, source=markers, controls=Controls(("up",)), params=PARAMS, fps=24.0)
    write_take(take, tmp_path / "take.h5")
    for name, vertices in (("face", RIG.deform(PARAMS)), ("other", RIG.deform(-PARAMS))):
        sequence = MeshSequence(RIG.mesh, time, lambda rows, v=vertices: v[rows], 24.0)
        write_mesh_sequence(sequence, tmp_path / f"{name}.h5")
    return tmp_path


def test_a_sheet_of_a_mesh_sequence_shows_frames_that_differ(facert, folder: Path) -> None:
    outcome = facert("render", folder / "face.h5", folder / "sheet.png", "--size", "64")
    assert outcome.code == 0
    assert len(outcome.out.split("frames ")[1].split(",")) == 6
    assert imread(folder / "sheet.png").std() > 0.02


def test_the_frames_of_a_sheet_come_from_the_part_that_was_asked_for(facert, folder: Path) -> None:
    arguments = ("render", folder / "face.h5", folder / "sheet.png", "--frames", "10..20")
    outcome = facert(*arguments, "--size", "64")
    frames = [int(frame) for frame in outcome.out.split("frames ")[1].split(",")]
    assert frames
    assert all(10 <= frame <= 20 for frame in frames)


def test_a_clip_shows_faces_side_by_side(facert, folder: Path) -> None:
    arguments = ["render", folder / "face.h5", folder / "clip.gif", "--size", "64"]
    outcome = facert(*arguments, "--beside", folder / "other.h5", "--truth", folder / "face.h5")
    assert (outcome.code, "20 frames, 1.0 s at 20 frames/s" in outcome.out) == (0, True)
    with Image.open(folder / "clip.gif") as clip:
        assert (clip.width, clip.n_frames) == (3 * 64, 20)


def test_a_take_and_a_mesh_sequence_stand_side_by_side(facert, folder: Path) -> None:
    arguments = ["render", folder / "take.h5", folder / "clip.mp4", "--rig", folder / "rig.h5"]
    outcome = facert(*arguments, "--truth", folder / "face.h5", "--size", "64", "--fps", "12")
    assert (outcome.code, "12 frames, 1.0 s at 12 frames/s" in outcome.out) == (0, True)
    assert (folder / "clip.mp4").stat().st_size > 500


WRONG = [
    (("take.h5", "a.png"), 3, "--rig: expected the character's rig"),
    (("face.h5", "a.avi"), 3, "ends in"),
    (("face.h5", "a.gif", "--frames", "0,5"), 2, "100..400"),
    (("face.h5", "a.gif", "--frames", "20..24"), 3, "a part of 0..23"),
    (("face.h5", "a.png", "--frames", "20..24"), 3, "a part of 0..23"),
    (("face.h5", "a.png", "--frames", "9..5"), 3, "a part of 0..23"),
    (("face.h5", "a.png", "--frames", "1..2..3"), 2, "numbers"),
    (("face.h5", "a.png", "--frames", "24"), 3, "frames from 0 to 23"),
    (("face.h5", "a.png", "--truth", "nothing.h5"), 3, "nothing.h5"),
    (("rig.h5", "a.png"), 3, "rig.h5"),
    (("face.h5", "a.png", *(("--beside", "face.h5") * 6)), 2, "at most 6 faces"),
]


@pytest.mark.parametrize(("arguments", "code", "message"), WRONG)
def test_what_cannot_be_drawn_is_refused(facert, folder: Path, arguments, code, message) -> None:
    named = [folder / one if one.endswith((".h5", ".png", ".gif", ".avi")) else one
             for one in arguments]  # fmt: skip
    outcome = facert("render", *named)
    assert outcome.code == code
    assert message in " ".join(outcome.err.replace("│", " ").split())
    assert not (folder / "a.png").exists()
    assert not (folder / "a.gif").exists()


@pytest.mark.parametrize("damaged", ["face", "other"])
def test_the_damaged_one_of_several_files_is_named(facert, folder: Path, damaged: str) -> None:
    with h5py.File(folder / f"{damaged}.h5", "r+") as file:
        file["vertices"][5] = np.nan
    outcome = facert(
        "render", folder / "face.h5", folder / "a.gif", "--beside", folder / "other.h5"
    )
    assert outcome.code == 3
    assert f"{damaged}.h5: /vertices: expected finite numbers" in outcome.err
    assert not (folder / "a.gif").exists()


def test_nothing_is_written_over(facert, folder: Path) -> None:
    (folder / "clip.gif").write_text("mine")
    assert facert("render", folder / "face.h5", folder / "clip.gif").code == 3
    assert (folder / "clip.gif").read_text() == "mine"


def test_a_mesh_without_extent_is_refused_before_its_frames_are_read(facert, folder: Path) -> None:
    with h5py.File(folder / "face.h5", "r+") as file:
        file["neutral"][:] = 1.0
        file["vertices"][:] = np.nan
    outcome = facert("render", folder / "face.h5", folder / "sheet.png")
    assert outcome.code == 3
    assert "/neutral: expected vertices apart from each other" in outcome.err
