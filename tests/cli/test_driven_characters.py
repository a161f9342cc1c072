"""Commands that write and draw a character turn its bones by ``--drivers``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.io.gltf.document import open_gltf
from facert.io.rig import write_rig
from facert.io.take import read_take, write_take
from facert.mesh.morphs import Morphs

FACE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) / 10
FACES = np.array([[0, 1, 2], [0, 2, 3]])
RIG = Rig(FACE, np.stack([FACE * 0.5]), ("smile",), FACES, "m")
TABLE = """
[[look]]
node = "character"
rotate = [0, 40, 0]
"""


@pytest.fixture(name="folder")
def _folder(tmp_path: Path) -> Path:
    from facert.io.gltf.writer import write_glb

    still = Morphs(RIG.mesh, RIG.shapes, RIG.names, np.zeros((1, 1)), np.zeros(1))
    write_glb(still, tmp_path / "character.glb")
    write_rig(RIG, tmp_path / "rig.h5")
    params = np.array([[0.0, 0.0], [0.5, 1.0], [1.0, 0.5]])
    source, controls = Source(params, ("a", "b")), Controls(("smile", "look"))
    write_take(Take(np.arange(3) / 30, source, controls, params), tmp_path / "take.h5")
    (tmp_path / "drivers.toml").write_text(TABLE)
    return tmp_path


def test_bones_are_listed_and_turned(facert, folder: Path) -> None:
    given = ("--rig", folder / "character.glb", "--drivers", folder / "drivers.toml")
    facts = json.loads(facert("inspect", folder / "character.glb", "--json").out)
    assert facts["nodes"] == ["character"]
    done = facert("convert", folder / "take.h5", folder / "out.glb", *given)
    assert "3 frames of 2 controls, all else as in character.glb" in done.out
    assert "animated: shapes of character; nodes character" in done.err
    with open_gltf(folder / "out.glb") as document:
        paths = [one["target"]["path"] for one in document.root["animations"][0]["channels"]]
        turned = document.numbers(document.root["animations"][0]["samplers"][1]["output"])
    assert paths == ["weights", "rotation"]
    np.testing.assert_allclose(2 * np.degrees(np.arcsin(turned[:, 1])), [0, 40, 20], atol=1e-4)
    command = ("render", folder / "take.h5", folder / "a.png", "--frames", "0,1", "--size", "64")
    assert facert(*command, *given).code == 0


def test_drivers_are_for_files_with_bones(facert, folder: Path) -> None:
    take, out, drivers = (
        folder / "take.h5",
        folder / "out.glb",
        ("--drivers", folder / "drivers.toml"),
    )
    refused = facert("convert", take, out, "--rig", folder / "rig.h5", *drivers)
    assert (refused.code, "--drivers: expected a .glb, .gltf or .vrm" in refused.err) == (3, True)
    refused = facert("render", take, folder / "a.png", *drivers)
    assert (refused.code, "Give it with --rig" in refused.err) == (3, True)
    refused = facert("convert", take, out, "--rig", folder / "character.glb")
    assert (refused.code, "--drivers maps controls to bones" in refused.err) == (3, True)
    (folder / "drivers.toml").write_text(TABLE.replace("look", "loook"))
    refused = facert("convert", take, out, "--rig", folder / "character.glb", *drivers)
    assert (refused.code, out.exists()) == (3, False)


def test_poses_of_a_bone_come_in_with_the_drivers(facert, folder: Path) -> None:
    poses, out = folder / "poses.csv", folder / "posed.h5"
    poses.write_text("frame,smile,look\n0,0,0\n1,0.5,-0.57\n2,1,0.3\n")
    command = ("convert", folder / "take.csv", out, "--poses", poses)
    (folder / "take.csv").write_text("time,a.x,a.y,a.z\n0,1,2,3\n.02,1,2,4\n.04,1,3,4\n")
    refused = facert(*command, "--rig", folder / "character.glb")
    said = " ".join(refused.err.split())
    assert (refused.code, "'look', which it has not" in said) == (3, True)
    assert "if it moves a bone or an object, give --drivers as well" in said
    given = ("--rig", folder / "character.glb", "--drivers", folder / "drivers.toml")
    done = facert(*command, *given)
    assert done.code == 0, done.err
    assert "limited to -1..1 by their poses: look" in done.err
    assert read_take(out).controls.limits.tolist() == [[0, 1], [-1, 1]]


def test_a_character_alone_is_copied(facert, folder: Path) -> None:
    done = facert("convert", folder / "character.glb", folder / "copy.glb")
    assert "the character as in character.glb" in done.out
    assert (folder / "copy.glb").read_bytes() == (folder / "character.glb").read_bytes()
