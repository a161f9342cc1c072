"""``facert suggest`` as a user calls it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

import facert as package
from facert.data.rig import Rig
from facert.data.take import Source, Take
from facert.io.formats import write_rig_file, write_take_file

VERTICES = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
RIG = Rig(VERTICES, VERTICES[None] * 0.5, ("smile",), np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.fixture(name="take")
def _take(make_take, tmp_path: Path) -> Take:
    take = replace(make_take(frames=90), start_timecode="01:00:00:00")
    write_take_file(take, tmp_path / "take.h5")
    return take


def test_frames_are_printed_with_their_timecodes(facert, take: Take, tmp_path: Path) -> None:
    outcome = facert("suggest", tmp_path / "take.h5", "-n", 4)
    chosen = package.suggest_frames(take, 4).frames
    assert outcome.code == 0
    for frame in chosen:
        assert f"01:00:0{frame // 30}:{frame % 30:02d}" in outcome.out
    assert f"in order of time: {','.join(map(str, np.sort(chosen)))}" in outcome.out


def test_json_is_for_programs(facert, take: Take, tmp_path: Path) -> None:
    outcome = facert("suggest", tmp_path / "take.h5", "-n", 4, "--have", "labels", "--json")
    expected = package.suggest_frames(take, 4, have=take.labels)
    rows = json.loads(outcome.out)["frames"]
    assert [row["frame"] for row in rows] == expected.frames.tolist()
    assert [row["share"] for row in rows] == expected.shares.tolist()
    assert rows[0]["seconds"] == take.time[expected.frames[0]]
    assert set(rows[0]) == {"frame", "seconds", "timecode", "share"}


def test_a_model_can_be_gone_on_from(facert, take: Take, tmp_path: Path) -> None:
    model = package.train(take, package.Settings(method="ssgpr"))
    model.save(tmp_path / "model.safetensors")
    arguments = ("suggest", tmp_path / "take.h5", "--json", "--have")
    rows = json.loads(facert(*arguments, tmp_path / "model.safetensors").out)["frames"]
    expected = package.suggest_frames(take, 10, have=model).frames
    assert [row["frame"] for row in rows] == expected.tolist()


def test_the_sheet_shows_markers(facert, take: Take, tmp_path: Path) -> None:
    arguments = ("suggest", tmp_path / "take.h5", "--sheet", tmp_path / "sheet.png")
    assert facert(*arguments).code == 0
    assert imread(tmp_path / "sheet.png").std() > 0.02
    assert facert(*arguments).code == 2  # it exists
    assert facert(*arguments, "--overwrite").code == 0


def test_the_sheet_of_weights_shows_the_actors_face(facert, tmp_path: Path) -> None:
    write_rig_file(RIG, tmp_path / "rig.h5")
    weights = np.abs(np.sin(np.arange(60)))[:, None]
    write_take_file(Take(np.arange(60) / 30, Source(weights, ["smile"])), tmp_path / "take.h5")
    arguments = ("suggest", tmp_path / "take.h5", "-n", 3, "--sheet", tmp_path / "sheet.png")
    assert "--rig: expected the actor's rig" in facert(*arguments).err
    assert not (tmp_path / "sheet.png").exists()
    assert facert(*arguments, "--rig", tmp_path / "rig.h5").code == 0
    assert imread(tmp_path / "sheet.png").std() > 0.02


WRONG = [
    (("-n", "91"), 3, "take.h5: count: expected 1 up to"),
    (("--have", "everything"), 2, "--have takes"),
    (("--have", "none.safetensors"), 3, "none.safetensors"),
    (("--rig", "rig.h5"), 2, "--sheet"),
    (("--sheet", "a.txt"), 3, "ends in"),
    (("--sheet", "a.png", "-n", "50"), 2, "at most 40 frames"),
]


@pytest.mark.parametrize(("options", "code", "message"), WRONG)
def test_what_cannot_be_done_is_refused(facert, take, tmp_path, options, code, message) -> None:
    outcome = facert("suggest", tmp_path / "take.h5", *options)
    assert outcome.code == code
    assert message in " ".join(outcome.err.replace("│", " ").split())


def test_going_on_from_labels_needs_some(facert, make_take, tmp_path: Path) -> None:
    write_take_file(make_take(posed=0), tmp_path / "take.h5")
    outcome = facert("suggest", tmp_path / "take.h5", "--have", "labels")
    assert outcome.code == 3
    assert "expected posed frames" in outcome.err


def test_who_asks_for_frames_to_pose_is_not_told_to_ask_for_them(facert, make_take, tmp_path):
    take = make_take(frames=60, posed=60)
    values = take.source.values.copy()
    values[:, 3:] = values[:1, 3:]
    still = replace(take, source=replace(take.source, values=values))
    package.train(still, package.Settings(method="gpr-linear")).save(tmp_path / "model.safetensors")
    package.write_take(make_take(frames=90, posed=0), tmp_path / "take.h5")
    done = facert(
        "suggest", tmp_path / "take.h5", "-n", 3, "--have", tmp_path / "model.safetensors"
    )
    assert done.code == 0
    assert "--have MODEL" not in done.err
