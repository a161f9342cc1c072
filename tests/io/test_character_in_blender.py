"""What Blender makes of a character that was carried through, and what Khronos says of it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from gltf_files import character

from facert.data.drivers import Drivers
from facert.io.gltf.character import Character
from facert.io.gltf.rig import read_gltf_rig

NAMES = ("jawOpen", "look", "nod")
DRIVERS = Drivers.of(
    {
        "look": {"node": "eye", "rotate": [0, 40, 10]},
        "jawOpen": {"node": "jaw", "rotate": [30, 0, 0], "translate": [0, -0.01, 0]},
        "nod": [{"node": "head", "rotate": [0, 20, 0]}, {"node": "jaw", "rotate": [0, 0, 9]}],
    }
)
RATE = 25
PARAMS = np.random.default_rng(0).random((5, 3))

IN_BLENDER = """
import json, sys, bpy, numpy
numpy.bool = bool  # the importer of this Blender is older than Debian's NumPy
path, out = sys.argv[-2:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 25
bpy.ops.import_scene.gltf(filepath=path)
frames = []
for frame in range(5):
    bpy.context.scene.frame_set(frame)
    graph, vertices, keys = bpy.context.evaluated_depsgraph_get(), {}, {}
    for one in bpy.data.objects:
        if one.type != "MESH":
            continue
        shown = one.evaluated_get(graph)
        placed = [shown.matrix_world @ v.co for v in shown.to_mesh().vertices]
        vertices[one.data.name] = [[v.x, v.z, -v.y] for v in placed]
        if one.data.shape_keys:
            keys |= {key.name: key.value for key in one.data.shape_keys.key_blocks[1:]}
    frames.append([vertices, keys])
materials = sorted(one.name for one in bpy.data.materials)
json.dump({"frames": frames, "materials": materials}, open(out, "w"))
"""
VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
  .then(report => console.log(JSON.stringify(report.issues)));
"""


@pytest.fixture(name="files", scope="module")
def _files(tmp_path_factory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("character")
    builder = character()
    for number, name in enumerate(("face", "teeth", "eye", "cornea", "stage")):
        builder.document.meshes[number].name = name
    given, out = builder.save(folder / "given.glb"), folder / "out.glb"
    Character(given, drivers=DRIVERS).write(NAMES, PARAMS, np.arange(5) / RATE, out)
    return given, out


def test_blender_moves_it_as_pictures_show_it(files: tuple[Path, Path]) -> None:
    given, out = files
    if not shutil.which("blender"):
        pytest.skip("no Blender here")
    script, found = given.with_name("look.py"), given.with_name("found.json")
    script.write_text(IN_BLENDER)
    command = ["blender", "-b", "--factory-startup", "--python", str(script), "--"]
    done = subprocess.run(
        [*command, str(out), str(found)], capture_output=True, text=True, check=True
    )
    assert found.exists(), done.stdout + done.stderr
    seen = json.loads(found.read_text())
    rig = read_gltf_rig(given, drivers=DRIVERS)
    assert rig.names == NAMES
    for params, (vertices, keys) in zip(PARAMS, seen["frames"], strict=True):
        assert keys["jawOpen"] == pytest.approx(params[0], abs=1e-5)
        shown = np.concatenate([vertices[name] for name in ("face", "teeth", "eye")])
        np.testing.assert_allclose(shown, rig.deform(params[None])[0], atol=1e-6)
        assert {"cornea", "stage"} <= vertices.keys()


def test_the_validator_finds_no_new_fault(files: tuple[Path, Path]) -> None:
    modules = os.environ.get("NODE_PATH", "")
    if not shutil.which("node") or not (Path(modules) / "gltf-validator").is_dir():
        pytest.skip("no gltf-validator: npm install it and set NODE_PATH to its node_modules")

    def faults(path: Path) -> set[tuple[str, str]]:
        command = ["node", "-e", VALIDATE, str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        messages = json.loads(done.stdout)["messages"]
        return {(one["code"], one.get("pointer", "")) for one in messages if one["severity"] < 2}

    assert faults(files[1]) <= faults(files[0])
