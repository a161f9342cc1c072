"""VRM avatars are GLB files, and their expressions are sums of targets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import Builder

from facert.errors import InputError
from facert.io.formats import read_mesh, read_rig_file, read_take_file
from facert.io.gltf.character import Character
from facert.io.gltf.document import open_gltf
from facert.io.gltf.rig import read_gltf_rig

TRIANGLE = np.eye(3, dtype=np.float32)
SMILE, BLINK = np.float32([[0, 1, 0]] * 3), np.float32([[0, 0, 2]] * 3)


def bind(mesh: int, index: int, weight: float) -> dict[str, float]:
    return {"mesh": mesh, "index": index, "weight": weight}


VRM0 = {
    "VRM": {
        "blendShapeMaster": {
            "blendShapeGroups": [
                {"name": "Joy", "presetName": "joy", "binds": [bind(0, 0, 50)]},
                {"name": "JawOpen", "presetName": "unknown", "binds": [bind(0, 1, 100)]},
                {"name": "A", "presetName": "a", "binds": [bind(0, 0, 100), bind(1, 0, 25)]},
                {"name": "Neutral", "presetName": "neutral", "binds": []},
            ]
        }
    }
}
NAMING = {
    "VRM": {
        "blendShapeMaster": {
            "blendShapeGroups": [
                {"name": "Joy", "presetName": "joy", "binds": [bind(0, 0, 100)]},
                {"name": "half", "binds": [bind(1, 0, 50)]},
                {"name": "JawOpen", "presetName": "unknown", "binds": [bind(0, 1, 100)]},
            ]
        }
    }
}
VRM1 = {
    "VRMC_vrm": {
        "specVersion": "1.0",
        "expressions": {
            "preset": {
                "joy": {"morphTargetBinds": [{"node": 0, "index": 0, "weight": 0.5}]},
                "a": {
                    "morphTargetBinds": [
                        {"node": 0, "index": 0, "weight": 1.0},
                        {"node": 1, "index": 0, "weight": 0.25},
                    ]
                },
                "neutral": {"isBinary": False},
            },
            "custom": {"JawOpen": {"morphTargetBinds": [{"node": 0, "index": 1, "weight": 1.0}]}},
        },
    }
}


def avatar(path: Path, extensions: dict[str, Any], names: bool = True) -> Path:
    builder = Builder()
    builder.mesh(TRIANGLE, {"smile": SMILE, "blink": BLINK})
    builder.mesh(TRIANGLE + 3, {"smile": SMILE})
    if not names:
        for mesh in builder.document.meshes:
            mesh.extras = {}
    builder.document.extensions = extensions
    return builder.save(path.with_suffix(".glb")).rename(path)


@pytest.mark.parametrize("extensions", [VRM0, VRM1], ids=["VRM 0", "VRM 1"])
def test_an_avatar_is_a_rig_whose_expressions_are_listed(tmp_path, caplog, extensions) -> None:
    caplog.set_level("INFO", "facert")
    path = avatar(tmp_path / "face.vrm", extensions)
    rig = read_rig_file(path)
    assert rig.names == ("smile", "blink")
    for name in ("joy", "a", "JawOpen"):
        assert name in caplog.text
    assert "--shapes expressions" in caplog.text
    assert ("looks along -z" in caplog.text) == (extensions is VRM0)
    assert len(read_mesh(path).vertices) == 6


@pytest.mark.parametrize("extensions", [VRM0, VRM1], ids=["VRM 0", "VRM 1"])
def test_its_expressions_are_shapes_when_they_are_asked_for(tmp_path, extensions) -> None:
    rig = read_rig_file(avatar(tmp_path / "face.vrm", extensions), "expressions")
    assert set(rig.names) == {"joy", "JawOpen", "a"}
    shapes = dict(zip(rig.names, rig.shapes, strict=True))
    np.testing.assert_allclose(shapes["joy"], [[0, 0.5, 0]] * 3 + [[0, 0, 0]] * 3)
    np.testing.assert_allclose(shapes["JawOpen"], [[0, 0, 2]] * 3 + [[0, 0, 0]] * 3)
    np.testing.assert_allclose(shapes["a"], [[0, 1, 0]] * 3 + [[0, 0.25, 0]] * 3)


def test_an_expression_names_the_single_target_that_it_sets(tmp_path: Path) -> None:
    rig = read_gltf_rig(avatar(tmp_path / "face.vrm", NAMING, names=False))
    assert rig.names == ("joy", "JawOpen", "target1")


def test_what_is_no_set_of_shapes_is_refused(tmp_path: Path) -> None:
    path = avatar(tmp_path / "face.vrm", VRM1)
    with pytest.raises(InputError, match="one of: targets, expressions"):
        read_rig_file(path, "arkit")
    with pytest.raises(InputError, match="one of: targets, found 'expressions'"):
        read_rig_file(avatar(tmp_path / "plain.vrm", {}), "expressions")


@pytest.mark.parametrize(
    "extensions",
    [
        {"VRM": {"blendShapeMaster": {"blendShapeGroups": [{"binds": [{"mesh": 0}]}]}}},
        {"VRM": {"blendShapeMaster": {"blendShapeGroups": 7}}},
        {"VRMC_vrm": {"expressions": {"preset": {"a": {"morphTargetBinds": [{"node": 99}]}}}}},
        {"VRMC_vrm": {"expressions": {"custom": {"a": {"morphTargetBinds": [1]}}}}},
    ],
)
def test_hostile_expressions_are_one_error(tmp_path: Path, extensions: dict[str, Any]) -> None:
    path = avatar(tmp_path / "face.vrm", json.loads(json.dumps(extensions)))
    with pytest.raises(InputError) as caught:
        read_gltf_rig(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_a_bind_of_a_target_that_is_not_there_is_one_error(tmp_path: Path) -> None:
    extensions = json.loads(json.dumps(VRM0))
    extensions["VRM"]["blendShapeMaster"]["blendShapeGroups"][0]["binds"][0]["index"] = 9
    with pytest.raises(InputError):
        read_gltf_rig(avatar(tmp_path / "face.vrm", extensions), "expressions")


def test_an_animation_in_an_avatar_is_a_take(tmp_path: Path) -> None:
    builder = Builder()
    builder.mesh(TRIANGLE, {"smile": SMILE, "blink": BLINK})
    builder.animate([0.0, 0.5], np.ones((2, 2)))
    path = builder.save(tmp_path / "face.glb").rename(tmp_path / "face.vrm")
    assert read_take_file(path).source.names == ("smile", "blink")


@pytest.mark.parametrize("interpolation", ["LINEAR", "CUBICSPLINE"])
def test_a_vrm_animation_is_a_take_of_expressions(tmp_path: Path, interpolation: str) -> None:
    builder = Builder()
    nodes = [builder.joint(), builder.joint(), builder.joint()]
    for node, values in zip(nodes, ([0, 0.5, 1], [1, 1, 0], [9, 9, 9]), strict=True):
        output = np.float32([[value, 7, 7] for value in values])
        if interpolation == "CUBICSPLINE":
            output = np.stack([0 * output, output, 0 * output], axis=1).reshape(-1, 3)
        builder.animate([0.0, 0.1, 0.2], [0], interpolation, node)
        channel = builder.document.animations.pop()
        channel.channels[0].target.path = "translation"
        channel.samplers[0].output = builder.accessor(output)
        if not builder.document.animations:
            builder.document.animations.append(channel)
            continue
        channel.channels[0].sampler = len(builder.document.animations[0].samplers)
        builder.document.animations[0].samplers += channel.samplers
        builder.document.animations[0].channels += channel.channels
    expressions = {"preset": {"aa": {"node": 0}}, "custom": {"jawOpen": {"node": 1}}}
    builder.document.extensions = {"VRMC_vrm_animation": {"expressions": expressions}}
    builder.document.scenes[0].nodes = nodes
    path = builder.save(tmp_path / "a.glb").rename(tmp_path / "a.vrma")
    take = read_take_file(path)
    assert take.source.names == ("aa", "jawOpen")
    np.testing.assert_allclose(take.source.values, [[0, 1], [0.5, 1], [1, 0]])


def test_expressions_of_one_name_are_numbered(tmp_path: Path) -> None:
    groups = [
        {"name": "A", "presetName": "a", "binds": [bind(0, 0, 100)]},
        {"name": "a", "presetName": "unknown", "binds": [bind(0, 1, 100)]},
        {"name": "a_2", "binds": [bind(1, 0, 100)]},
        {"name": "a", "binds": [bind(1, 0, 50)]},
    ]
    path = avatar(tmp_path / "a.vrm", {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}})
    rig = read_rig_file(path, "expressions")
    assert rig.names == ("a", "a_2", "a_2_2", "a_3")
    np.testing.assert_allclose(rig.shapes[1], [[0, 0, 2]] * 3 + [[0, 0, 0]] * 3)


@pytest.mark.parametrize("extensions", [VRM0, VRM1], ids=["VRM 0", "VRM 1"])
def test_its_expressions_are_animated_as_weights_of_their_meshes(
    tmp_path, caplog, extensions
) -> None:
    caplog.set_level("INFO", "facert")
    extensions = json.loads(json.dumps(extensions))
    if "VRM" in extensions:
        groups = extensions["VRM"]["blendShapeMaster"]["blendShapeGroups"]
        groups[0]["materialValues"] = [{"materialName": "face"}]
    else:
        joy = extensions["VRMC_vrm"]["expressions"]["preset"]["joy"]
        joy["materialColorBinds"] = [{"material": 0}]
    path = avatar(tmp_path / "face.vrm", extensions)
    values, out = np.array([[0.0, 0.2, 1.0], [0.4, 0.5, 0.0]]), tmp_path / "out.glb"
    character = Character(path, "expressions")
    character.write(("Joy", "JawOpen", "A"), values, np.arange(2.0), out)
    with open_gltf(out) as document:
        assert document.root["extensions"] == extensions
        animation = document.root["animations"][0]
        found = [document.numbers(one["output"])[:, 0] for one in animation["samplers"]]
    joy, jaw, a = values.T
    np.testing.assert_allclose(found[0].reshape(2, 2), np.stack([joy / 2 + a, jaw], axis=1))
    np.testing.assert_allclose(found[1], a / 4)
    assert "to materials is left aside: joy" in caplog.text.lower()
