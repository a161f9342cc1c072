"""The guides that begin with a recording, followed with real ones."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from following import DOCS, follow, stand_in

import facert
from facert.data.arrays import FloatArray
from facert.data.rig import Rig
from facert.io.gltf.writer import write_glb
from facert.mesh.morphs import Morphs

pytestmark = [pytest.mark.real, pytest.mark.slow]
FRAMES, SHOT, POSED = 900, 240, 20
RESTS = 1120  # the frame of the optical take after which the actor rests for a moment


def write_character(folder: Path, rig: Rig) -> None:
    rest = np.zeros((1, len(rig.names)))
    write_glb(Morphs(rig.mesh, rig.shapes, rig.names, rest, np.zeros(1)), folder / "character.glb")


def write_poses(folder: Path, recording: Path, names: list[str], poses: FloatArray) -> None:
    """The known poses of the frames that facert suggests."""
    frames = facert.suggest_frames(facert.read_take(recording), POSED).frames
    with (folder / "poses.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["frame", *names], *([f, *poses[f]] for f in frames)])


def error(found: facert.Take, truth: FloatArray) -> float:
    """Of the poses, relative to that of the mean pose."""
    still = truth - truth.mean(axis=0)
    return float(np.sqrt(np.mean((found.params - truth) ** 2) / np.mean(still**2)))


def test_an_iphone_drives_a_makehuman_character(real_data: Path, tmp_path: Path) -> None:
    folder = tmp_path / "phone-demo"
    folder.mkdir()
    for name, utterance, frames in [
        ("recording", "utterance_a", 600),
        ("shot", "utterance_b", SHOT),
    ]:
        rows = (real_data / f"recordings/{utterance}.csv").read_text().splitlines(keepends=True)
        (folder / f"{name}.csv").write_text("".join(rows[: frames + 1]))
    rig = facert.read_rig(real_data / "rigs/makehuman_head.npz", shapes="unit")
    ours = {"eye-left-closure": "lid_L", "eyebrows-left-up": "brow_L"}  # as in the guide
    names = [ours.get(name, name) for name in rig.names]
    write_character(folder, Rig(rig.neutral, rig.shapes, tuple(names), rig.faces))
    track = np.load(real_data / "tracks/utterance_a.npz")
    write_poses(folder, folder / "recording.csv", names, track["units"])

    follow(DOCS / "phone-to-blender.md", tmp_path)
    shot = facert.read_take(folder / "shot.h5")
    assert error(shot, np.load(real_data / "tracks/utterance_b.npz")["units"][:SHOT]) < 0.6


def test_real_optical_markers_drive_a_rig(real_data: Path, tmp_path: Path) -> None:
    folder = tmp_path / "optical-demo"
    folder.mkdir()
    track = np.load(real_data / "tracks/optical_cheeks.npz")
    file = np.load(real_data / "markers/cheeks.npz")
    # The guide names the stable markers of its own actor.
    ours = {
        "ForeHead_M": "forehead",
        "ForeHead_L": "forehead_L",
        "ForeHead_R": "forehead_R",
        "NoseTop": "nose_bridge",
    }
    names = tuple(ours.get(name, name) for name in file["names"].tolist())
    time, markers = np.arange(len(file["positions"])) / 60.0, 10.0 * file["positions"]
    part_of_shot = slice(RESTS, RESTS + SHOT)
    for name, part in [("recording", slice(0, FRAMES)), ("shot", part_of_shot)]:
        stand_in()["_write_trc"](folder / f"{name}.trc", time[part], names, markers[part])
    write_character(folder, facert.read_rig(real_data / "rigs/ict_face.npz"))
    controls = track["solved_names"].tolist()
    write_poses(folder, folder / "recording.trc", controls, track["solved"])

    follow(DOCS / "optical-markers.md", tmp_path)
    result = facert.read_take(folder / "result.h5")
    assert error(result, track["solved"][part_of_shot]) < 1.0
