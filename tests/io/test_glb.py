"""GLB files play the same motion in any program."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from facert.data.rig import Mesh, MeshSequence
from facert.errors import InputError, OutputExistsError
from facert.io.gltf.writer import write_glb
from facert.mesh.morphs import Morphs, compact_morphs

BALL = trimesh.creation.icosphere(2, radius=9.0)
GREY = np.full(BALL.vertices.shape, 0.5)
MESH = Mesh(np.array([1, 2, 3]) + BALL.vertices, BALL.faces, "cm", GREY)
TIME = 5 + np.arange(20) / 30
WAVES = np.sin(np.linspace(0, 6, 20))[:, None, None] * [[[0.0, 1.0, 0.3]]]
MOTION = MESH.vertices + WAVES * np.cos(BALL.vertices[:, :1])
MORPHS = compact_morphs(MeshSequence(MESH, TIME, lambda rows: MOTION[rows]))


@dataclass(frozen=True)
class Document:
    """What a reader that follows the specification finds in a GLB file."""

    json: dict[str, Any]
    bytes: bytes

    def accessor(self, number: int) -> np.ndarray:
        one = self.json["accessors"][number]
        view = self.json["bufferViews"][one["bufferView"]]
        dtype = {5126: "<f4", 5125: "<u4"}[one["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3}[one["type"]]
        values = np.frombuffer(self.bytes, dtype, one["count"] * width, view["byteOffset"])
        return values.reshape(-1, width).astype(float)

    def vertices(self) -> np.ndarray:
        """Every frame of the first animation, (T, V, 3)."""
        primitive = self.json["meshes"][0]["primitives"][0]
        sampler = self.json["animations"][0]["samplers"][0]
        targets = np.stack([self.accessor(one["POSITION"]) for one in primitive["targets"]])
        weights = self.accessor(sampler["output"]).reshape(-1, len(targets))
        base = self.accessor(primitive["attributes"]["POSITION"])
        return base + np.einsum("tk,kvc->tvc", weights, targets)


def read(path: Path) -> Document:
    content = path.read_bytes()
    magic, version, size, length, kind = struct.unpack("<4sIII4s", content[:20])
    assert (magic, version, size, kind) == (b"glTF", 2, len(content), b"JSON")
    rest = content[20 + length :]
    assert rest[4:8] == b"BIN\0"
    return Document(json.loads(content[20 : 20 + length]), rest[8:])


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    path = tmp_path / "face.glb"
    write_glb(MORPHS, path)
    return path


def test_the_animation_has_the_vertices_of_every_frame(path: Path) -> None:
    np.testing.assert_allclose(read(path).vertices(), MOTION, atol=1e-5)


def test_keys_begin_at_zero_and_keep_their_times(path: Path) -> None:
    document = read(path)
    times = document.accessor(document.json["animations"][0]["samplers"][0]["input"])
    np.testing.assert_allclose(times[:, 0], TIME - 5, atol=1e-6)


def test_targets_bear_names(path: Path) -> None:
    mesh = read(path).json["meshes"][0]
    assert mesh["extras"]["targetNames"] == list(MORPHS.names)
    assert len(mesh["weights"]) == len(MORPHS.names)


def test_another_library_finds_the_rest_pose_in_metres(path: Path) -> None:
    scene = trimesh.load_scene(path, process=False)
    (mesh,) = scene.dump()
    np.testing.assert_allclose(mesh.vertices, MESH.vertices / 100, atol=1e-7)
    np.testing.assert_array_equal(mesh.faces, MESH.faces)


def test_normals_have_length_one_even_without_a_triangle(tmp_path: Path) -> None:
    lone = Mesh(np.vstack([MESH.vertices, [[0, 0, 99]]]), MESH.faces)
    targets = np.zeros((1, len(lone.vertices), 3))
    write_glb(Morphs(lone, targets, ("a",), np.zeros((2, 1)), np.arange(2.0)), tmp_path / "a.glb")
    document = read(tmp_path / "a.glb")
    number = document.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]
    np.testing.assert_allclose(np.linalg.norm(document.accessor(number), axis=1), 1, atol=1e-6)


def test_an_existing_file_is_kept(path: Path) -> None:
    with pytest.raises(OutputExistsError):
        write_glb(MORPHS, path)


def test_a_mesh_without_triangles_is_refused(tmp_path: Path) -> None:
    points = replace(MORPHS, neutral=Mesh(MESH.vertices, np.empty((0, 3), dtype=int)))
    with pytest.raises(InputError, match="/faces"):
        write_glb(points, tmp_path / "face.glb")
    assert not list(tmp_path.iterdir())


def test_a_single_frame_is_how_the_mesh_is_seen(tmp_path: Path) -> None:
    one = replace(MORPHS, weights=MORPHS.weights[3:4], time=MORPHS.time[3:4])
    write_glb(one, tmp_path / "face.glb")
    document = read(tmp_path / "face.glb")
    assert "animations" not in document.json
    assert document.json["meshes"][0]["weights"] == MORPHS.weights[3].tolist()


VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
  .then(report => console.log(JSON.stringify(report.issues)));
"""


@pytest.mark.parametrize("frames", [20, 1])
def test_the_validator_of_khronos_finds_no_fault(tmp_path: Path, frames: int) -> None:
    modules = os.environ.get("NODE_PATH", "")
    if not shutil.which("node") or not (Path(modules) / "gltf-validator").is_dir():
        pytest.skip("no gltf-validator: npm install it and set NODE_PATH to its node_modules")
    path = tmp_path / "face.glb"
    write_glb(replace(MORPHS, weights=MORPHS.weights[:frames], time=TIME[:frames]), path)
    result = subprocess.run(
        ["node", "-e", VALIDATE, str(path)], capture_output=True, text=True, check=True
    )
    issues = json.loads(result.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues
