"""A character is carried through: the take's animation is added, and all else stays."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import Builder, glb
from scipy.spatial.transform import Rotation

from facert import InputError
from facert.data.drivers import Drivers
from facert.io.gltf.carried import CarriedFile
from facert.io.gltf.character import Character
from facert.io.gltf.container import read_container
from facert.io.gltf.document import Document, bears_mark, open_gltf
from facert.io.gltf.rig import read_gltf_rig
from facert.io.gltf.take import read_gltf_take

TRIANGLE = np.float32([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
NAMES = ("jawOpen", "browInnerUp", "eyeLookIn")
TIME = np.arange(5) / 30 + 7
PARAMS = np.linspace(0, 1, 15).reshape(5, 3)
REST = Rotation.from_euler("xyz", [0.3, -0.2, 0.5])
DRIVERS = Drivers.of(
    {
        "eyeLookIn": {"node": "eye", "rotate": [0, 30, 0]},
        "jawOpen": [
            {"node": "eye", "rotate": [10, 0, 0], "translate": [0.2, 0, 0]},
            {"node": "jaw", "translate": [0, 0.1, 0]},
        ],
    }
)


def shape(x: float) -> np.ndarray:
    return np.float32([[x, 0, 0]] * 3)


@pytest.fixture(name="builder")
def _builder() -> Builder:
    """A face, teeth with a shape of the same name, an eye below a scaled node, and a camera."""
    builder = Builder()
    face = {"jawOpen": shape(1), "browInnerUp_L": shape(2), "browInnerUp_R": shape(3)}
    builder.mesh(TRIANGLE, face | {"still": shape(0)}, name="face")
    builder.document.meshes[0].weights = [0.0, 0.0, 0.0, 0.25]
    builder.mesh(TRIANGLE, {"other": shape(1), "jawOpen": shape(4)}, name="teeth")
    builder.mesh(TRIANGLE, {}, name="eye", rotation=REST.as_quat().tolist(), translation=[1, 2, 3])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = 2 * REST.as_matrix(), [5, 6, 7]
    jaw = builder.joint(name="jaw", matrix=matrix.T.ravel().tolist())
    top = builder.joint(name="top", scale=[0.01] * 3, children=[2, jaw])
    builder.document.scenes[0].nodes = [0, 1, top]
    builder.document.extras = {"mine": [1, 2.5, "three"]}
    builder.document.extensionsUsed = ["VENDOR_unknown"]
    builder.document.extensions = {"VENDOR_unknown": {"deep": {"of": [True, None]}}}
    return builder


def written(path: Path, out: Path, drivers: Drivers | None = DRIVERS, frames: int = 5) -> Document:
    names = NAMES if drivers else NAMES[:2]
    params = PARAMS[:frames, : len(names)]
    Character(path, drivers=drivers).write(names, params, TIME[:frames], out, True)
    with open_gltf(out) as document:
        return document


def channels(document: Document, number: int = 0) -> dict[tuple[str, str], np.ndarray]:
    animation, nodes = document.root["animations"][number], document.root["nodes"]
    found = {}
    for one in animation["channels"]:
        sampler = animation["samplers"][one["sampler"]]
        values = document.numbers(sampler["output"])
        name, kind = nodes[one["target"]["node"]]["name"], one["target"]["path"]
        found[name, kind] = values.reshape(5, -1)
        np.testing.assert_allclose(document.numbers(sampler["input"])[:, 0], TIME - 7, atol=1e-6)
    return found


def views(root: dict[str, Any], buffers: Any) -> list[bytes]:
    begins = [(one["buffer"], one.get("byteOffset", 0), one["byteLength"]) for one in
              root["bufferViews"]]  # fmt: skip
    return [bytes(buffers[number][begin : begin + size]) for number, begin, size in begins]


def test_all_but_the_animation_stays(builder: Builder, tmp_path: Path) -> None:
    given = builder.save(tmp_path / "given.glb")
    document = written(given, tmp_path / "out.glb")
    was, now = read_container(given), read_container(tmp_path / "out.glb")
    for key in was.root.keys() - {"asset", "buffers", "bufferViews", "accessors", "nodes"}:
        assert now.root[key] == was.root[key], key
    for key in ("bufferViews", "accessors"):
        assert now.root[key][: len(was.root[key])] == was.root[key]
    old = views(was.root, was.buffers())
    assert views(now.root, document.buffers)[: len(old)] == old
    assert [one for i, one in enumerate(now.root["nodes"]) if i != 3] == [
        one for i, one in enumerate(was.root["nodes"]) if i != 3
    ]
    assert bears_mark(tmp_path / "out.glb")
    assert not bears_mark(given)


def test_every_mesh_with_a_control_moves_and_other_shapes_stay(builder, tmp_path, caplog) -> None:
    caplog.set_level("INFO")
    found = channels(written(builder.save(tmp_path / "in.glb"), tmp_path / "out.glb", None))
    jaw, brow = PARAMS[:, 0], PARAMS[:, 1]
    face = np.column_stack([jaw, brow, brow, np.full(5, 0.25)])
    np.testing.assert_allclose(found["face", "weights"], face, atol=1e-6)
    np.testing.assert_allclose(
        found["teeth", "weights"], np.column_stack([0 * jaw, jaw]), atol=1e-6
    )
    assert len(found) == 2
    assert "animated: shapes of face, teeth" in caplog.text
    assert read_gltf_rig(tmp_path / "out.glb").names == read_gltf_rig(tmp_path / "in.glb").names


def test_nodes_turn_about_their_own_axes_from_where_they_rest(builder, tmp_path) -> None:
    document = written(builder.save(tmp_path / "in.glb"), tmp_path / "out.glb")
    found = channels(document)
    vectors = np.radians(np.column_stack([10 * PARAMS[:, 0], 30 * PARAMS[:, 2], 0 * TIME]))
    turned = Rotation.from_quat(found["eye", "rotation"])
    assert (turned * (REST * Rotation.from_rotvec(vectors)).inv()).magnitude().max() < 1e-6
    # 0.2 m of the scene are 20 of the node above, which is scaled to a hundredth.
    along = REST.apply([1, 0, 0])
    shifted = [1, 2, 3] + 20 * PARAMS[:, :1] * along
    np.testing.assert_allclose(found["eye", "translation"], shifted, rtol=1e-6)
    shifted = [5, 6, 7] + 10 * PARAMS[:, :1] * REST.apply([0, 1, 0])
    np.testing.assert_allclose(found["jaw", "translation"], shifted, rtol=1e-6)
    jaw = next(node for node in document.root["nodes"] if node["name"] == "jaw")
    assert "matrix" not in jaw
    np.testing.assert_allclose(jaw["scale"], 2)
    np.testing.assert_allclose(jaw["translation"], [5, 6, 7])


def test_a_single_frame_is_how_the_character_is_seen(builder, tmp_path) -> None:
    document = written(builder.save(tmp_path / "in.glb"), tmp_path / "out.glb", frames=1)
    assert "animations" not in document.root or not document.root["animations"]
    nodes = {node["name"]: node for node in document.root["nodes"]}
    brow = PARAMS[0, 1]
    np.testing.assert_allclose(nodes["face"]["weights"], [0, brow, brow, 0.25])
    turned = REST * Rotation.from_rotvec([0, np.radians(30 * PARAMS[0, 2]), 0])
    np.testing.assert_allclose(Rotation.from_quat(nodes["eye"]["rotation"]).as_matrix(),
                               turned.as_matrix(), atol=1e-9)  # fmt: skip


def test_an_old_animation_of_the_same_is_replaced_and_others_stay(builder, tmp_path, caplog):
    caplog.set_level("INFO")
    builder.animate(np.arange(2), np.zeros((2, 4)))
    builder.document.animations[0].name = "old"
    builder.animate(np.arange(2), np.ones((2, 3)), node=4)
    builder.document.animations[1].channels[0].target.path = "scale"
    builder.document.animations[1].name = "walk"
    out = tmp_path / "out.glb"
    document = written(builder.save(tmp_path / "in.glb"), out)
    assert [one["name"] for one in document.root["animations"]] == ["out", "walk"]
    assert "animation old moved the same: replaced" in caplog.text
    assert "animation walk is kept" in caplog.text
    assert len(read_gltf_take(out)) == 5


def test_what_lies_beside_a_document_comes_into_the_file(builder, tmp_path) -> None:
    """Buffers in files and in the JSON, pictures in a folder below; nothing from elsewhere."""
    picture = base64.b64decode(
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
    )
    plain = read_container(builder.save(tmp_path / "plain.glb"))
    root, folder = read_container(tmp_path / "plain.glb").root, tmp_path / "deep"
    (folder / "textures").mkdir(parents=True)
    (folder / "textures" / "skin a.png").write_bytes(picture)
    (folder / "textures" / "secret.png").write_text("key = 1")
    (tmp_path / "above.png").write_bytes(picture)
    (folder / "link.png").symlink_to(tmp_path / "above.png")
    half = root["bufferViews"][2]["byteOffset"]
    first, second = plain.buffers()[0][:half], plain.buffers()[0][half:]
    (folder / "a.bin").write_bytes(first + b"x")
    uri = "data:application/octet-stream;base64," + base64.b64encode(second).decode()
    root["buffers"] = [
        {"uri": "a.bin", "byteLength": half},
        {"uri": uri, "byteLength": len(second)},
    ]
    for view in root["bufferViews"][2:]:
        view.update(buffer=1, byteOffset=view["byteOffset"] - half)
    names = ["textures/skin%20a.png", "textures/secret.png", "../above.png", "link.png", "gone.png"]
    names += ["./textures/skin a.png"]
    root["images"] = [{"uri": name} for name in names]
    (folder / "face.gltf").write_text(json.dumps(root))
    document = written(folder / "face.gltf", tmp_path / "out.glb")
    old = views(plain.root, plain.buffers())
    assert views(document.root, document.buffers)[: len(old)] == old
    assert len(document.root["buffers"]) == 1
    embedded, *others, again = document.root["images"]
    assert again == embedded
    assert embedded["mimeType"] == "image/png"
    assert views(document.root, document.buffers)[embedded["bufferView"]] == picture
    assert [one["uri"] for one in others] == names[1:-1]
    assert b"key = 1" not in (tmp_path / "out.glb").read_bytes()
    np.testing.assert_allclose(
        read_gltf_rig(tmp_path / "out.glb").shapes, read_gltf_rig(tmp_path / "plain.glb").shapes
    )


def test_compressed_data_is_carried_that_nobody_here_can_read(builder, tmp_path) -> None:
    """Draco, and meshopt with a buffer that is left out; a chunk of an unknown kind."""
    plain = read_container(builder.save(tmp_path / "plain.glb"))
    root, content = plain.root, plain.buffers()[0]
    root["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    packed = {"buffer": 1, "byteOffset": 4, "byteLength": 8, "byteStride": 4, "count": 2}
    left_out = {"byteLength": 99, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}
    uri = "data:application/octet-stream;base64," + base64.b64encode(bytes(range(16))).decode()
    root["buffers"] = [left_out, {"uri": uri, "byteLength": 16}]
    root["bufferViews"] = [
        {"buffer": 0, "byteLength": 8, "extensions": {"EXT_meshopt_compression": packed}}
    ]
    chunk = b"\x04\0\0\0WHAT1234"
    whole = bytearray(glb(root, content) + chunk)
    whole[8:12] = len(whole).to_bytes(4, "little")
    (tmp_path / "packed.glb").write_bytes(whole)
    Character(tmp_path / "packed.glb").write(NAMES[:2], PARAMS[:, :2], TIME, tmp_path / "out.glb")
    found = read_container(tmp_path / "out.glb")
    assert found.others == chunk
    assert found.root["buffers"][1] == left_out
    view = found.root["bufferViews"][0]
    assert (view["buffer"], found.own[4:12]) == (1, bytes(range(4, 12)))
    assert view["extensions"]["EXT_meshopt_compression"] == packed | {"buffer": 0}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"buffers": [{"uri": "../a.bin", "byteLength": 4}]}, "data in the file or beside it"),
        ({"buffers": [{"byteLength": 2**40}]}, "valid glTF 2.0, found damaged data"),
        ({"bufferViews": [{"buffer": 7, "byteLength": 4}]}, "valid glTF 2.0"),
        ({"nodes": [{"mesh": 9}]}, "valid glTF 2.0"),
        ({"meshes": [], "nodes": [], "scenes": []}, "morph targets.*--drivers"),
    ],
)
def test_a_damaged_file_is_refused(builder, tmp_path, change, message) -> None:
    plain = read_container(builder.save(tmp_path / "plain.glb"))
    (tmp_path / "bad.glb").write_bytes(glb(plain.root | change, plain.buffers()[0]))
    with pytest.raises(InputError, match=message):
        Character(tmp_path / "bad.glb")


@pytest.mark.parametrize("wrong", [5, [{}], [{"channels": [{"sampler": 0, "target": {}}]}]])
def test_a_damaged_animation_is_refused(builder, tmp_path, wrong) -> None:
    plain = read_container(builder.save(tmp_path / "plain.glb"))
    (tmp_path / "bad.glb").write_bytes(glb(plain.root | {"animations": wrong}, plain.own or b""))
    with pytest.raises(InputError, match=r"valid glTF 2\.0, found damaged data"):
        written(tmp_path / "bad.glb", tmp_path / "out.glb")
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"jawOpen": {"node": "eyes", "rotate": [1, 0, 0]}}, "'eyes'.*Did you mean 'eye'"),
        ({"jawOpn": {"node": "eye", "rotate": [1, 0, 0]}}, "'jawOpn'.*Did you mean 'jawOpen'"),
    ],
)
def test_a_driver_of_nothing_is_refused(builder, tmp_path, tables, message) -> None:
    path = builder.save(tmp_path / "in.glb")
    with pytest.raises(InputError, match=message):
        written(path, tmp_path / "out.glb", Drivers.of(tables))
    assert not (tmp_path / "out.glb").exists()


def test_a_copy_is_the_same_file_but_for_its_author(builder, tmp_path) -> None:
    given = builder.save(tmp_path / "in.glb")
    CarriedFile(given).write(tmp_path / "out.glb", False)
    was, now = read_container(given), read_container(tmp_path / "out.glb")
    assert (was.own, {**was.root, "asset": 0}) == (now.own, {**now.root, "asset": 0})
