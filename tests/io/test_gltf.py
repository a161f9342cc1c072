"""Rigs and animations come out of glTF files of other programs."""

from __future__ import annotations

import base64
import json
import logging
from pathlib import Path

import numpy as np
import pygltflib as gltf
import pytest
import trimesh
from gltf_files import Builder

from facert.data.labelling import weights_as_poses
from facert.data.rig import Rig
from facert.errors import InputError
from facert.io.formats import read_mesh
from facert.io.gltf.buffer import Buffer
from facert.io.gltf.rig import read_gltf_mesh, read_gltf_rig
from facert.io.gltf.take import kind_of, read_gltf_take
from facert.io.gltf.writer import write_glb
from facert.io.npz import read_npz_rig
from facert.io.tables.livelink import read_livelink
from facert.mesh.morphs import rig_morphs
from facert.render.faces import control_settings

BLENDER = Path(__file__).parent / "files" / "blender.glb"  # made and exported in Blender 5.0
TRIANGLE = np.eye(3, dtype=np.float32)
SMILE, BLINK = np.float32([[0, 1, 0]] * 3), np.float32([[0, 0, 2]] * 3)
RNG = np.random.default_rng(0)
FACE = Rig(
    RNG.normal(size=(20, 3)),
    RNG.normal(size=(3, 20, 3)),
    ("jawOpen", "mouthSmile_L", "brow"),
    RNG.integers(0, 20, (9, 3)),
    "cm",
    RNG.random((20, 3)),
)
WEIGHTS = RNG.random((7, 3))
TIME = np.arange(7) / 25


@pytest.fixture(name="builder")
def _builder() -> Builder:
    builder = Builder()
    builder.mesh(TRIANGLE, {"smile": SMILE, "blink": BLINK})
    return builder


def test_a_face_of_blender_is_a_rig_where_its_scene_places_it() -> None:
    rig = read_gltf_rig(BLENDER)
    assert rig.names == ("smile", "blink")
    assert rig.units == "m"
    np.testing.assert_allclose(rig.neutral.max(axis=0), [2, 5, 0])
    moved = np.abs(rig.shapes[0]).max(axis=1) > 0
    np.testing.assert_allclose(rig.shapes[0][moved], [[0, 0.5, 1]])
    np.testing.assert_allclose(rig.neutral[moved], [[0, 5, 0]])


def test_vertices_that_an_exporter_cut_in_several_are_one_again() -> None:
    rig = read_gltf_rig(BLENDER)  # Blender's mesh has five vertices, its export seven
    assert rig.neutral.shape == (5, 3)
    assert len(np.unique(rig.faces)) == 5
    np.testing.assert_array_equal(read_gltf_mesh(BLENDER).vertices, rig.neutral)


def test_a_mesh_without_targets_can_be_read_at_rest(tmp_path: Path) -> None:
    builder = Builder()
    builder.mesh(TRIANGLE, {}, translation=[1, 0, 0])
    path = builder.save(tmp_path / "still.glb")
    np.testing.assert_array_equal(read_gltf_mesh(path).vertices, TRIANGLE + np.float32([1, 0, 0]))
    with pytest.raises(InputError, match="morph targets"):
        read_gltf_rig(path)
    assert read_mesh(path).units == "m"


def test_an_animation_of_blender_is_a_take_of_weights() -> None:
    take = read_gltf_take(BLENDER)
    assert take.source.names == ("smile", "blink")
    assert take.fps == 25.0
    np.testing.assert_allclose(take.time, np.arange(1, 12) / 25, atol=1e-7)
    np.testing.assert_allclose(take.source.values[[0, 5, 10]], [[0, 1], [1, 0], [0.5, 0.5]])


def test_what_facert_writes_it_reads(tmp_path: Path) -> None:
    write_glb(rig_morphs(FACE, WEIGHTS, TIME), tmp_path / "face.glb")
    rig, take = read_gltf_rig(tmp_path / "face.glb"), read_gltf_take(tmp_path / "face.glb")
    np.testing.assert_allclose(rig.neutral, FACE.neutral / 100, atol=1e-7)
    np.testing.assert_allclose(rig.shapes, FACE.shapes / 100, atol=1e-7)
    np.testing.assert_allclose(rig.colours, FACE.colours, atol=1e-6)
    np.testing.assert_array_equal(rig.faces, FACE.faces)
    assert rig.names == take.source.names == FACE.names
    np.testing.assert_array_equal(take.source.values, WEIGHTS.astype(np.float32))
    np.testing.assert_allclose(take.time, TIME, atol=1e-7)


def test_writing_what_was_read_gives_the_same_arrays_again(tmp_path: Path) -> None:
    write_glb(rig_morphs(FACE, WEIGHTS, TIME), tmp_path / "0.glb")
    for number in (1, 2):
        rig, take = (
            read(tmp_path / f"{number - 1}.glb") for read in (read_gltf_rig, read_gltf_take)
        )
        write_glb(rig_morphs(rig, take.source.values, take.time), tmp_path / f"{number}.glb")
    again = read_gltf_rig(tmp_path / "2.glb")
    np.testing.assert_array_equal(again.neutral, rig.neutral.astype(np.float32))
    np.testing.assert_array_equal(again.shapes, rig.shapes.astype(np.float32))


@pytest.mark.real
def test_a_recorded_performance_plays_the_same_after_a_round_trip(
    real_data: Path, tmp_path: Path
) -> None:
    rig = read_npz_rig(real_data / "rigs" / "makehuman_head.npz", "arkit")
    take = weights_as_poses(read_livelink(real_data / "recordings" / "utterance_b.csv"), rig)
    params = control_settings(take, rig, range(len(take)))
    write_glb(rig_morphs(rig, params, take.time), tmp_path / "face.glb")
    back, played = read_gltf_rig(tmp_path / "face.glb"), read_gltf_take(tmp_path / "face.glb")
    frames = np.searchsorted(played.time, take.time - 1e-3)[::97]  # pauses are filled
    vertices = back.deform(played.source.values[frames])
    np.testing.assert_allclose(vertices, rig.deform(params[::97]), atol=1e-5)


def test_another_library_finds_the_names_that_facert_wrote(tmp_path: Path) -> None:
    write_glb(rig_morphs(FACE, WEIGHTS, TIME), tmp_path / "face.glb")
    document = gltf.GLTF2().load(str(tmp_path / "face.glb"))
    assert tuple(document.meshes[0].extras["targetNames"]) == FACE.names
    assert document.animations[0].channels[0].target.path == "weights"


def test_meshes_with_targets_of_one_name_are_one_rig(builder: Builder, tmp_path: Path) -> None:
    quarter = [0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]  # about z
    builder.mesh(TRIANGLE, {"blink": SMILE}, translation=[1, 0, 0], rotation=quarter)
    builder.mesh(TRIANGLE, {})
    rig = read_gltf_rig(builder.save(tmp_path / "two.glb"))
    assert rig.names == ("smile", "blink")
    assert rig.neutral.shape == (6, 3)
    np.testing.assert_allclose(rig.neutral[3:], [[1, 1, 0], [0, 0, 0], [1, 0, 1]], atol=1e-6)
    np.testing.assert_allclose(rig.shapes[1], [[0, 0, 2]] * 3 + [[-1, 0, 0]] * 3, atol=1e-6)
    np.testing.assert_array_equal(rig.shapes[0, 3:], 0)
    np.testing.assert_array_equal(rig.faces, [[0, 1, 2], [3, 4, 5]])


def test_a_sparse_target_moves_only_some_vertices(tmp_path: Path) -> None:
    builder = Builder()
    places = builder.view(np.uint8([2, 0, 0, 0]))
    moves = builder.view(np.float32([[0, 0, 5]]))
    sparse = gltf.Sparse(
        count=1,
        indices=gltf.AccessorSparseIndices(bufferView=places, componentType=5121),
        values=gltf.AccessorSparseValues(bufferView=moves),
    )
    number = builder.accessor(np.zeros((3, 3), np.float32), bufferView=None, sparse=sparse)
    builder.mesh(TRIANGLE, {"lift": number})
    rig = read_gltf_rig(builder.save(tmp_path / "sparse.glb"))
    np.testing.assert_array_equal(rig.shapes[0], [[0, 0, 0], [0, 0, 0], [0, 0, 5]])


def test_normalised_and_interleaved_numbers_are_read(tmp_path: Path) -> None:
    builder = Builder()
    pairs = np.int16([[32767, 0, -32767, 9], [0, 32767, 0, 9], [0, 0, 32767, 9]])
    view = builder.view(pairs, stride=8)
    number = builder.accessor(pairs[:, :3].copy(), bufferView=view, normalized=True)
    builder.mesh(TRIANGLE, {"move": number})
    rig = read_gltf_rig(builder.save(tmp_path / "packed.glb"))
    np.testing.assert_allclose(rig.shapes[0], [[1, 0, -1], [0, 1, 0], [0, 0, 1]])


def test_a_document_with_its_buffer_beside_it_or_inside(builder: Builder, tmp_path: Path) -> None:
    wanted = read_gltf_rig(builder.save(tmp_path / "face.glb"))
    root = json.loads(gltf.GLTF2().load(str(tmp_path / "face.glb")).to_json())
    (tmp_path / "my face.bin").write_bytes(builder.content)
    inside = f"data:application/octet-stream;base64,{base64.b64encode(builder.content).decode()}"
    for uri in ("my%20face.bin", inside):
        root["buffers"][0]["uri"] = uri
        (tmp_path / "face.gltf").write_text(json.dumps(root))
        np.testing.assert_array_equal(read_gltf_rig(tmp_path / "face.gltf").shapes, wanted.shapes)
    root["buffers"][0]["uri"] = "lost.bin"
    (tmp_path / "face.gltf").write_text(json.dumps(root))
    with pytest.raises(InputError, match=r"lost\.bin: file: expected an existing file"):
        read_gltf_rig(tmp_path / "face.gltf")


KEYS = np.array([[0.0, 0.0], [1.0, 0.5], [0.5, 1.0]])


def test_keys_far_apart_are_sampled_as_they_are_interpolated(
    builder: Builder, tmp_path: Path
) -> None:
    builder.animate([0.0, 0.1, 0.5], KEYS)
    take = read_gltf_take(builder.save(tmp_path / "a.glb"))
    assert take.fps == 10.0
    wanted = [[0, 0], [1, 0.5], [0.875, 0.625], [0.75, 0.75], [0.625, 0.875], [0.5, 1]]
    np.testing.assert_allclose(take.source.values, wanted, atol=1e-6)


def test_steps_stay_and_cubic_splines_pass_through_their_values(tmp_path: Path) -> None:
    step, cubic = Builder(), Builder()
    for one in (step, cubic):
        one.mesh(TRIANGLE, {"smile": SMILE, "blink": BLINK})
    step.animate([0.0, 0.1, 0.5], KEYS, "STEP")
    stepped = read_gltf_take(step.save(tmp_path / "step.glb")).source.values
    np.testing.assert_array_equal(stepped, KEYS[[0, 1, 1, 1, 1, 2]])
    slopes = np.array([[2.0, 1.0]] * 3)
    cubic.animate([0.0, 0.1, 0.5], np.stack([slopes, KEYS, slopes], axis=1), "CUBICSPLINE")
    curve = read_gltf_take(cubic.save(tmp_path / "cubic.glb")).source.values
    np.testing.assert_allclose(curve[[0, 1, 5]], KEYS, atol=1e-6)
    middle = (KEYS[1] + KEYS[2]) / 2 + 0.4 / 8 * (slopes[1] - slopes[2])
    np.testing.assert_allclose(curve[3], middle, atol=1e-6)


def test_of_several_animations_one_must_be_chosen(builder: Builder, tmp_path: Path) -> None:
    for name, value in (("talk", 0.25), ("shout", 0.75)):
        builder.animate([0.0, 0.5], np.full((2, 2), value))
        builder.document.animations[-1].name = name
    path = builder.save(tmp_path / "two.glb")
    with pytest.raises(InputError, match="one of: talk, shout"):
        read_gltf_take(path)
    with pytest.raises(InputError, match="found 'sing'"):
        read_gltf_take(path, "sing")
    assert read_gltf_take(path, "shout").source.values.max() == 0.75


def test_a_rig_without_an_animation_holds_no_take(builder, tmp_path, caplog) -> None:
    caplog.set_level(logging.INFO, "facert")
    path = builder.save(tmp_path / "still.glb")
    assert kind_of(path) == "rig"
    assert not caplog.records
    with pytest.raises(InputError, match="an animation of morph targets"):
        read_gltf_take(path)


def test_targets_without_names_are_numbered(builder: Builder, tmp_path: Path) -> None:
    builder.document.meshes[0].extras = {}
    assert read_gltf_rig(builder.save(tmp_path / "a.glb")).names == ("target1", "target2")


def test_vertices_lie_where_another_library_has_them(tmp_path: Path) -> None:
    builder = Builder()
    random = np.random.default_rng(1)
    for number in range(3):
        points = np.float32(random.normal(size=(6, 3)))
        turn = random.normal(size=4)
        builder.mesh(
            points,
            {f"shape{number}": np.float32(random.normal(size=(6, 3)))},
            translation=random.normal(size=3).tolist(),
            rotation=(turn / np.linalg.norm(turn)).tolist(),
            scale=[[1.0, 2.0, 0.5], [-1.0, 1.0, 1.0], [0.01, 0.01, 0.01]][number],
        )
    builder.document.nodes[1].children, builder.document.scenes[0].nodes = [2], [0, 1]
    path = builder.save(tmp_path / "face.glb")
    theirs = np.asarray(trimesh.load_scene(path).to_geometry().vertices)
    ours = read_gltf_rig(path).neutral
    order = [np.lexsort(np.round(points, 5).T) for points in (ours, theirs)]
    np.testing.assert_allclose(ours[order[0]], theirs[order[1]], atol=1e-5)


def test_without_a_scene_nodes_stand_below_their_parents(tmp_path: Path) -> None:
    builder = Builder()
    builder.mesh(TRIANGLE, {"smile": SMILE})
    builder.document.nodes.append(gltf.Node(children=[0], scale=[2.0] * 3))
    builder.document.scenes, builder.document.scene = [], None
    rig = read_gltf_rig(builder.save(tmp_path / "face.glb"))
    np.testing.assert_array_equal(rig.neutral, 2 * TRIANGLE)


@pytest.mark.parametrize(("scale", "told"), [(200.0, True), (1.0, False), (1e-4, True)])
def test_a_mesh_that_is_no_face_s_size_in_metres_is_logged(tmp_path, caplog, scale, told) -> None:
    builder = Builder()
    builder.mesh(TRIANGLE, {"smile": SMILE}, scale=[scale] * 3)
    read_gltf_rig(builder.save(tmp_path / "face.glb"))
    assert ("--in-units" in caplog.text) == told


def test_what_float32_cannot_hold_is_not_written() -> None:
    for add in (Buffer().vertices, Buffer().keys):
        with pytest.raises(InputError, match="numbers that float32 can hold"):
            add(np.array([[0.0, 1e39, 0.0]]))
