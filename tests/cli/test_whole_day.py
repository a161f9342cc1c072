"""A character TD's day by the command line, on two real recordings whose true poses are known."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib as gltf
import pytest

import facert as api
from facert.data.arrays import FloatArray, rms
from facert.data.resampling import nearest_frames
from facert.data.rig import Rig
from facert.io.gltf.writer import write_glb
from facert.mesh.morphs import Morphs

pytestmark = [pytest.mark.real, pytest.mark.slow]
FRAMES = {"first": 450, "second": 240}
UTTERANCES = {"first": "utterance_a", "second": "utterance_b"}
POSED, MORE = 12, 5
GAZE = "gaze_L"
DEGREES = 30.0
DRIVERS = f'[[{GAZE}]]\nnode = "eye_L"\nrotate = [0, {DEGREES:g}, 0]\n'

IN_BLENDER = """
import json, sys, bpy, numpy
numpy.bool = bool  # the importer of this Blender is older than Debian's NumPy
path, frames, out = sys.argv[-3:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 30
bpy.ops.import_scene.gltf(filepath=path)
eye = bpy.data.objects["eye_L"]
keys = next(one for one in bpy.data.objects if getattr(one.data, "shape_keys", None))
seen = []
for frame in map(int, frames.split(",")):
    bpy.context.scene.frame_set(frame)
    blocks = keys.data.shape_keys.key_blocks[1:]
    turned = eye.matrix_world.to_quaternion().angle
    seen.append([{block.name: block.value for block in blocks}, turned])
bones = sorted(bone.name for one in bpy.data.armatures for bone in one.bones)
json.dump({"seen": seen, "bones": bones}, open(out, "w"))
"""


@dataclass
class Day:
    """The folder of a day, the true poses of both recordings, and how to run a command in it."""

    folder: Path
    names: list[str]
    truth: dict[str, FloatArray]
    run: Callable[..., Any]

    def __call__(self, command: str, *more: object, code: int = 0) -> Any:
        """Run a command; words with a dot are files of the folder."""
        words = [str(self.folder / word) if "." in word else word for word in command.split()]
        done = self.run(*words, *more)
        assert done.code == code, f"{command}: {done.err}"
        return replace(done, err=" ".join(done.err.split()))

    def write_poses(self, name: str, take: str, frames: list[int], **odd: object) -> None:
        """A table of the true poses of some frames; `odd` has a slip to make in it."""
        names, poses = list(self.names), self.truth[take][frames].round(4)
        if "typo" in odd:
            names[names.index(odd["typo"])] += "e"
        if "percent" in odd:
            poses[:, names.index(odd["percent"])] *= 100
        with (self.folder / name).open("w", newline="") as file:
            rows = ([f, *pose] for f, pose in zip(frames, poses.tolist(), strict=True))
            csv.writer(file).writerows([["frame", *names], *rows])

    def error(self, others_than: list[int]) -> float:
        """RMS of the shot's poses, at frames that nobody posed."""
        errors = api.read_take(self.folder / "shot.h5").params - self.truth["second"]
        return rms(np.delete(errors, others_than, axis=0))


@pytest.fixture(name="day")
def _day(real_data: Path, tmp_path: Path, facert) -> Day:
    truth = {}
    for name, utterance in UTTERANCES.items():
        rows = (real_data / f"recordings/{utterance}.csv").read_text().splitlines(keepends=True)
        (tmp_path / f"{name}.csv").write_text("".join(rows[: FRAMES[name] + 1]))
        source = api.read_take(tmp_path / f"{name}.csv").source
        inward, outward = (source.names.index(f"eyeLook{way}Left") for way in ("In", "Out"))
        gaze = source.values[:, inward] - source.values[:, outward]
        units = np.load(real_data / f"tracks/{utterance}.npz")["units"][: len(gaze)]
        truth[name] = np.column_stack([units, gaze])
    rig = api.read_rig(real_data / "rigs/makehuman_head.npz", shapes="unit")
    write_character(rig, tmp_path / "character.glb")
    (tmp_path / "drivers.toml").write_text(DRIVERS)
    return Day(tmp_path, [*rig.names, GAZE], truth, facert)


def write_character(rig: Rig, path: Path) -> None:
    """A part of a head with all its shapes, an eyeball of its own and a skeleton."""
    faces = rig.faces[:: max(1, len(rig.faces) // 300)]
    used, inverse = np.unique(faces, return_inverse=True)
    part = Rig(rig.neutral[used] / 10, rig.shapes[:, used] / 10, rig.names, inverse.reshape(-1, 3))
    rest = np.zeros((1, len(rig.names)))
    write_glb(Morphs(part.mesh, part.shapes, part.names, rest, np.zeros(1)), path)
    document = gltf.GLTF2.load(str(path))
    document.asset.generator = "another program"
    document.animations = []
    eye = document.meshes[0].primitives[0].attributes.POSITION
    primitive = gltf.Primitive(
        attributes=gltf.Attributes(POSITION=eye), indices=document.meshes[0].primitives[0].indices
    )
    document.meshes.append(gltf.Mesh(name="eyeball", primitives=[primitive]))
    count = len(document.nodes)
    document.nodes += [
        gltf.Node(name="eye_L", mesh=1, translation=[0.3, 0.5, 0.4], scale=[0.05] * 3),
        gltf.Node(name="jaw"),
        gltf.Node(name="head", children=[count, count + 1]),
    ]
    document.skins.append(gltf.Skin(joints=[count + 2, count + 1]))
    document.scenes[0].nodes.append(count + 2)
    document.save(str(path))


def suggested(day: Day, command: str) -> list[int]:
    found = json.loads(day(f"{command} --json").out)["frames"]
    return sorted(row["frame"] for row in found)


def test_a_day_from_two_recordings_to_blender_and_a_report(day: Day) -> None:
    posed = pose_the_first(day)
    assert len(posed) == POSED

    day("train posed.h5 -o first.safetensors")
    done = day("retarget second.csv shot.h5 -m first.safetensors")
    assert any(verdict in done.out for verdict in ("good", "look at it", "bad"))
    more = suggested(day, f"suggest second.csv -n {MORE} --have first.safetensors")
    alone = day.error(more)
    still = day.truth["second"] - day.truth["first"][posed].mean(axis=0)
    assert alone < 0.6 * rms(still)

    frame = correct_the_worst(day)
    day.write_poses("more.csv", "second", more)
    day("convert second.csv second.h5 --poses more.csv --rig character.glb --drivers drivers.toml")
    day("train posed.h5 second.h5 -o both.safetensors")
    day("retarget second.csv shot.h5 -m both.safetensors --overwrite")
    assert day.error(more) < 0.6 * alone
    kept = api.read_take(day.folder / "shot.h5").corrections
    assert kept is not None
    assert kept.frames.tolist() == [frame]

    day("train posed.h5 second.h5 shot.h5 -o all.safetensors")
    # The corrected frame brings two along as they were predicted.
    assert api.load(day.folder / "all.safetensors").labels == POSED + MORE + 1 + 2
    day("convert shot.h5 shot.glb --rig character.glb --drivers drivers.toml")
    day("report shot.h5 -o report.html --rig character.glb --drivers drivers.toml")
    page = (day.folder / "report.html").read_text(encoding="utf-8")
    assert "both.safetensors" in page
    look_in_blender(day)


def pose_the_first(day: Day) -> list[int]:
    """Pose the suggested frames: first with a typo, then one control in percent, then right."""
    frames = suggested(day, f"suggest first.csv -n {POSED}")
    convert = "convert first.csv posed.h5 --poses poses.csv --rig character.glb"
    convert += " --drivers drivers.toml"
    slip = day.names[int(day.truth["first"][frames, :-1].max(axis=0).argmax())]
    day.write_poses("poses.csv", "first", frames, typo=slip)
    refused = day(convert, code=3)
    assert f"Did you mean {slip!r}?" in refused.err
    assert not (day.folder / "posed.h5").exists()
    day.write_poses("poses.csv", "first", frames, percent=slip)
    warned = day(convert)
    assert "in percent, it seems" in warned.err
    assert f"{slip} up to" in warned.err
    day.write_poses("poses.csv", "first", frames)
    done = day(f"{convert} --overwrite")
    assert "percent" not in done.err
    take = api.read_take(day.folder / "posed.h5")
    assert take.controls.names == tuple(day.names)
    np.testing.assert_allclose(take.params[frames], day.truth["first"][frames], atol=1e-4)
    return frames


def correct_the_worst(day: Day) -> int:
    """Correct three controls of the worst frame, and see it get better, and those beside it."""
    before, truth = api.read_take(day.folder / "shot.h5").params, day.truth["second"]
    errors = before - truth
    frame = int((errors**2).sum(axis=1).argmax())
    for control in np.abs(errors[frame]).argsort()[-3:]:
        day(
            f"correct shot.h5 --frame {frame} -m first.safetensors --overwrite --only",
            *("--set", f"{day.names[control]}={truth[frame, control]:.4f}"),
        )
    after = api.read_take(day.folder / "shot.h5").params
    beside = slice(max(frame - 3, 0), frame + 4)
    assert rms(after[frame] - truth[frame]) < 0.9 * rms(errors[frame])
    assert rms(after[beside] - truth[beside]) < rms(errors[beside])
    return frame


def look_in_blender(day: Day) -> None:
    """See that in Blender shapes and eye of the character move nearly as the truth does."""
    if not shutil.which("blender"):
        pytest.skip("no Blender here to open the character in; all before it went well")
    frames = [0, 60, 120, 180]
    script, found = day.folder / "look.py", day.folder / "seen.json"
    script.write_text(IN_BLENDER)
    command = ["blender", "-b", "--factory-startup", "--python", str(script), "--"]
    asked = [str(day.folder / "shot.glb"), ",".join(map(str, frames)), str(found)]
    done = subprocess.run([*command, *asked], capture_output=True, text=True, check=True)
    assert found.exists(), done.stdout + done.stderr
    looked = json.loads(found.read_text())
    assert looked["bones"] == ["head", "jaw"]
    shot, truth = api.read_take(day.folder / "shot.h5"), day.truth["second"]
    shapes = day.names[:-1]
    places = nearest_frames(shot.time, np.array(frames) / 30)
    for place, (keys, turned) in zip(places, looked["seen"], strict=True):
        values = [keys[name] for name in shapes]
        np.testing.assert_allclose(values, shot.params[place, :-1], atol=0.01)
        assert rms(np.array(values) - truth[place, :-1]) < 0.2
        gaze = abs(shot.params[place, -1]) * DEGREES
        assert np.degrees(turned) == pytest.approx(gaze, abs=0.5)
