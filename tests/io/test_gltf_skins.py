"""A skinned mesh is at rest where its joints have it, whatever its own node says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gltf_files import Builder
from scipy.spatial.transform import Rotation

from facert.data.rig import Rig
from facert.errors import InputError
from facert.io.gltf.rig import read_gltf_mesh, read_gltf_rig

HEAD = np.float32([[-0.1, 1.5, 0], [0.1, 1.5, 0], [-0.1, 1.7, 0.02]])
JAW = np.float32([[0, -0.03, 0], [0, -0.03, 0], [0, 0, 0.01]])
FIRST = np.float32([[1, 0, 0, 0]] * 3)


def matrix(scale: float = 1.0, turn: float = 0.0, place: tuple[float, ...] = (0, 0, 0)):
    """Scaled, turned about x by degrees, moved."""
    result = np.eye(4)
    result[:3, :3] = scale * Rotation.from_euler("x", turn, degrees=True).as_matrix()
    result[:3, 3] = place
    return result


def inside(points: np.ndarray, space: np.ndarray) -> np.ndarray:
    """Points of the scene as they are in a mesh's own space."""
    return np.float32((points - space[:3, 3]) @ np.linalg.inv(space[:3, :3]).T)


def skinned(
    builder: Builder, space: np.ndarray, weights: np.ndarray = FIRST, **skin: object
) -> None:
    """The head, in a space of its own, tied to joints."""
    jaw = np.float32(JAW @ np.linalg.inv(space[:3, :3]).T)
    attributes = {
        "JOINTS_0": builder.accessor(np.uint8([[0, 1, 0, 0]] * 3)),
        "WEIGHTS_0": builder.accessor(weights, normalized=weights.dtype.kind == "u"),
    }
    builder.mesh(inside(HEAD, space), {"jawOpen": jaw}, attributes, **skin)


def require_head(path: Path) -> Rig:
    rig = read_gltf_rig(path)
    np.testing.assert_allclose(rig.neutral, HEAD, atol=1e-6)
    np.testing.assert_allclose(rig.shapes[0], JAW, atol=1e-6)
    np.testing.assert_allclose(read_gltf_mesh(path).vertices, HEAD, atol=1e-6)
    return rig


@pytest.mark.parametrize(
    "space",
    [
        matrix(1000.0),
        matrix(0.01),
        matrix(100.0, 90.0),
        matrix(1.0, -90.0, (0, 3, 1)),
        matrix(39.37, 30.0, (10, 0, -2)),
    ],
)
@pytest.mark.parametrize("own", [{}, {"scale": [7.0, 7.0, 7.0], "translation": [1.0, 2.0, 3.0]}])
def test_the_inverse_bind_matrices_undo_units_axes_and_place(tmp_path, space, own) -> None:
    builder = Builder()
    joints = [builder.joint(), builder.joint(translation=[0.0, 1.0, 0.0])]
    worlds = np.stack([matrix(), matrix(place=(0, 1, 0))])
    builder.document.scenes[0].nodes += joints
    skin = builder.skin(joints, np.linalg.inv(worlds) @ space)
    halves = np.float32([[0.5, 0.5, 0, 0], [1, 0, 0, 0], [0.25, 0.75, 0, 0]])
    skinned(builder, space, halves, skin=skin, **own)
    require_head(builder.save(tmp_path / "head.glb"))


def test_an_armature_in_centimetres_turned_by_90_degrees_is_undone(tmp_path: Path) -> None:
    builder = Builder()
    armature = matrix(0.01, -90.0)
    head = builder.joint(translation=[0.0, 0.0, 150.0])
    top = builder.joint(scale=[0.01] * 3, rotation=[-np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    builder.document.nodes[top].children = [head]
    builder.document.scenes[0].nodes.append(top)
    inverse = np.linalg.inv(matrix(place=(0, 0, 150.0)))
    skin = builder.skin([head], inverse[None])
    skinned(builder, armature, skin=skin)
    require_head(builder.save(tmp_path / "head.glb"))


def test_joints_outside_of_the_scene_have_their_place_too(tmp_path: Path) -> None:
    builder = Builder()
    child = builder.joint(translation=[0.0, 5.0, 0.0])
    top = builder.joint(scale=[0.001] * 3)
    builder.document.nodes[top].children = [child]
    inverse = np.linalg.inv(matrix(place=(0, 5.0, 0)))
    skinned(builder, matrix(0.001), skin=builder.skin([child], inverse[None]))
    require_head(builder.save(tmp_path / "head.glb"))


def test_without_inverse_bind_matrices_the_joints_alone_count(tmp_path: Path) -> None:
    builder = Builder()
    joint = builder.joint(translation=[0.0, 1.5, 0.0])
    builder.document.scenes[0].nodes.append(joint)
    skinned(builder, matrix(place=(0, 1.5, 0)), skin=builder.skin([joint]))
    require_head(builder.save(tmp_path / "head.glb"))


@pytest.mark.parametrize(
    "weights",
    [
        np.uint8([[128, 127, 0, 0], [254, 0, 0, 0], [60, 60, 0, 0]]),
        np.uint16([[40000, 25535, 0, 0], [1, 1, 0, 0], [65535, 0, 0, 0]]),
        np.float32([[0.5, 0.1, 0, 0], [3, 1, 0, 0], [0, 0, 0, 0]]),
        np.float32([[0.5, -1e-9, 0, 0], [-1, 0, 0, 0], [1, -1, 0, 0]]),
    ],
)
def test_weights_count_as_shares_of_their_sum(tmp_path: Path, weights: np.ndarray) -> None:
    builder = Builder()
    joints = [builder.joint(), builder.joint()]
    skinned(builder, matrix(), weights, skin=builder.skin(joints))
    require_head(builder.save(tmp_path / "head.glb"))


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_weight_of_a_joint_that_is_no_number_is_one_error(tmp_path, wrong, recwarn) -> None:
    builder = Builder()
    weights = np.float32([[wrong, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]])
    skinned(builder, matrix(), weights, skin=builder.skin([builder.joint(), builder.joint()]))
    with pytest.raises(InputError, match="NaN or infinity for the weight of a joint"):
        read_gltf_rig(builder.save(tmp_path / "head.glb"))
    assert not recwarn.list


def test_each_vertex_follows_its_own_joints_also_of_a_second_set(tmp_path: Path) -> None:
    builder = Builder()
    joints = [
        builder.joint(),
        builder.joint(translation=[2.0, 0, 0]),
        builder.joint(scale=[3.0] * 3),
    ]
    zeros = np.zeros((3, 4), np.uint8)
    second = np.float32([[0, 0, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0]])
    attributes = {
        "JOINTS_0": builder.accessor(zeros + np.uint8([0, 1, 0, 0])),
        "WEIGHTS_0": builder.accessor(np.float32([[1, 0, 0, 0], [0.5, 0.5, 0, 0], [0, 0, 0, 0]])),
        "JOINTS_1": builder.accessor(zeros + np.uint8([2, 255, 255, 255])),
        "WEIGHTS_1": builder.accessor(second),
    }
    builder.mesh(HEAD, {"jawOpen": JAW}, attributes, skin=builder.skin(joints))
    rig = read_gltf_rig(builder.save(tmp_path / "head.glb"))
    np.testing.assert_allclose(
        rig.neutral, HEAD * [[1], [1], [3]] + [[0, 0, 0], [1, 0, 0], [0] * 3]
    )
    np.testing.assert_allclose(rig.shapes[0], JAW * [[1], [1], [3]])


def test_meshes_of_two_skins_are_one_face(tmp_path: Path) -> None:
    builder = Builder()
    for scale in (0.001, 100.0):
        joint = builder.joint(scale=[scale] * 3)
        skinned(builder, matrix(scale), skin=builder.skin([joint]))
    rig = read_gltf_rig(builder.save(tmp_path / "head.glb"))
    np.testing.assert_allclose(rig.neutral[:3], HEAD, atol=1e-6)  # the second's are the same
    assert np.ptp(rig.neutral, axis=0).max() < 0.21


@pytest.mark.parametrize("scale", [[-1.0, 1, 1], [1, 1, 1], [-1, -1, 1], [-2, -2, -2]])
def test_a_mirrored_mesh_shows_its_outside(tmp_path: Path, scale: list[float]) -> None:
    ties = {"JOINTS_0": np.uint8([[0] * 4] * 3), "WEIGHTS_0": FIRST}
    for skin in (False, True):
        builder = Builder()
        if skin:
            joint = builder.joint(scale=scale)
            attributes = {key: builder.accessor(value) for key, value in ties.items()}
            builder.mesh(HEAD, {"jawOpen": JAW}, attributes, skin=builder.skin([joint]))
        else:
            builder.mesh(HEAD, {"jawOpen": JAW}, scale=scale)
        rig = read_gltf_rig(builder.save(tmp_path / "head.glb"))
        np.testing.assert_allclose(rig.neutral, HEAD * np.float32(scale))
        turned = np.prod(scale) < 0
        assert rig.faces.tolist() == ([[2, 1, 0]] if turned else [[0, 1, 2]])


def test_a_skin_whose_mesh_has_no_joints_leaves_it_at_its_node(tmp_path: Path) -> None:
    builder = Builder()
    builder.mesh(HEAD, {"jawOpen": JAW}, skin=builder.skin([builder.joint()]), scale=[2.0] * 3)
    rig = read_gltf_rig(builder.save(tmp_path / "head.glb"))
    np.testing.assert_allclose(rig.neutral, HEAD * 2)


def test_the_weights_that_a_file_shows_are_not_in_the_neutral(tmp_path: Path, caplog) -> None:
    caplog.set_level("INFO", "facert")
    builder = Builder()
    builder.mesh(HEAD, {"jawOpen": JAW, "smile": JAW})
    builder.document.meshes[0].weights = [0.25, 0]
    rig = read_gltf_rig(builder.save(tmp_path / "head.glb"))
    np.testing.assert_array_equal(rig.neutral, HEAD)
    assert "shows the mesh with jawOpen 0.25" in caplog.text
    assert "smile" not in caplog.text
