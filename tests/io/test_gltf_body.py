"""What a character has beside its shapes is shown around the face, and follows driven nodes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib as gltf
import pytest
from gltf_files import Builder
from scipy.spatial.transform import Rotation

from facert import Controls, Source, Take
from facert.data.drivers import Drivers
from facert.data.rig import CLAY, Rig
from facert.data.units import with_units
from facert.io.gltf.rig import read_gltf_rig
from facert.render.faces import frame_faces, posed_face

FACE = np.float32([[-0.1, 0, 0], [0.1, 0, 0], [0, 0.2, 0]])
EYE = np.float32([[0, 0, 0], [0.02, 0, 0], [0, 0.02, 0]])
AT, DOWN = np.array([0.05, 0.1, 0.01]), np.array([0, -0.02, 0])
DRIVERS = Drivers.of(
    {
        "look": {"node": "eye", "rotate": [0, 0, 90]},
        "jawOpen": {"node": "jaw", "rotate": [30, 0, 0], "translate": [0, -0.01, 0]},
    }
)


@pytest.fixture(name="builder")
def _builder() -> Builder:
    """A face that hangs by half on a jaw; an eye below a head; teeth, a body, a cornea, a stage."""
    builder = Builder()
    jaw = builder.joint(name="jaw", translation=[0, 0.05, 0])
    head = builder.joint(name="head", scale=[0.01] * 3, children=[jaw])
    builder.document.nodes[jaw].translation = [0, 5, 0]
    skin = builder.skin([head, jaw], np.stack([np.diag([100, 100, 100, 1.0]), _bound()]))
    joints, weights = np.uint8([[0, 1, 9, 9]] * 3), np.float32([[0.5, 0.5, 0, 0], [1, 0, 0, 0]] * 2)
    tied = {"JOINTS_0": builder.accessor(joints), "WEIGHTS_0": builder.accessor(weights[:3])}
    builder.mesh(FACE, {"jawOpen": np.float32([[0, -0.02, 0]] * 3)}, tied, skin=skin, name="face")
    both = np.float32([[0, 1, 0, 0]] * 3)
    tied = {"JOINTS_0": builder.accessor(joints), "WEIGHTS_0": builder.accessor(both)}
    builder.mesh(FACE * 0.5, {}, tied, skin=skin, name="teeth")
    builder.mesh(EYE, {}, name="eye", translation=[0.05, 0.1, 0.01])
    builder.mesh(EYE, {}, name="cornea", translation=[0.05, 0.1, 0.02])
    builder.mesh(FACE * 100, {}, name="stage", translation=[0, -9, 0])
    builder.document.materials = [
        gltf.Material(pbrMetallicRoughness=gltf.PbrMetallicRoughness(baseColorFactor=[1, 0, 0, 1])),
        gltf.Material(alphaMode="BLEND"),
    ]
    for mesh, material in ((2, 0), (3, 1)):
        builder.document.meshes[mesh].primitives[0].material = material
    return builder


def _bound() -> np.ndarray:
    matrix = np.diag([100, 100, 100, 1.0])
    matrix[1, 3] = -5
    return matrix


def posed(rig: Rig, **values: float) -> np.ndarray:
    return rig.deform([[values.get(name, 0.0) for name in rig.names]])[0]


def test_meshes_around_the_face_are_shown_in_their_colours(builder, tmp_path, caplog) -> None:
    caplog.set_level("INFO")
    rig = read_gltf_rig(builder.save(tmp_path / "in.glb"))
    assert (rig.names, rig.shapes.shape, len(rig.whole.vertices)) == (("jawOpen",), (1, 3, 3), 9)
    np.testing.assert_allclose(posed(rig)[3:6], FACE * 0.5, atol=1e-7)
    np.testing.assert_allclose(posed(rig)[6:], EYE + AT, atol=1e-7)
    np.testing.assert_allclose(rig.whole.colours[:6], np.tile(CLAY, (6, 1)))
    np.testing.assert_allclose(rig.whole.colours[6:], [[1, 0, 0]] * 3)
    assert "without shapes, for pictures only: teeth, eye" in caplog.text
    assert "seen through, so not shown: cornea" in caplog.text
    np.testing.assert_allclose(posed(rig, jawOpen=1)[3:], posed(rig)[3:])


def test_the_eye_turns_where_it_is(builder, tmp_path) -> None:
    rig = read_gltf_rig(builder.save(tmp_path / "in.glb"), drivers=DRIVERS)
    assert rig.names == ("jawOpen", "look")
    assert not rig.shapes[1].any()
    turned = EYE @ Rotation.from_euler("z", 45, degrees=True).as_matrix().T
    np.testing.assert_allclose(posed(rig, look=0.5)[6:], turned + AT, atol=1e-7)
    np.testing.assert_allclose(posed(rig, look=0.5)[:6], posed(rig)[:6])


def test_the_jaw_takes_what_is_skinned_to_it_by_its_weight(builder, tmp_path) -> None:
    rig = read_gltf_rig(builder.save(tmp_path / "in.glb"), drivers=DRIVERS)
    hinge = np.array([0, 0.05, 0])
    turn = Rotation.from_euler("x", 30, degrees=True).as_matrix().T

    def by_jaw(vertices: np.ndarray) -> np.ndarray:
        return np.asarray((vertices - hinge) @ turn + hinge + [0, -0.01, 0])

    found, shaped = posed(rig, jawOpen=1), FACE + DOWN
    np.testing.assert_allclose(found[3:6], by_jaw(FACE * 0.5), atol=1e-7)
    half = np.array([0.5, 0, 0.5])[:, None]
    np.testing.assert_allclose(found[:3], (1 - half) * shaped + half * by_jaw(shaped), atol=1e-7)


def test_another_unit_moves_all_alike(builder, tmp_path) -> None:
    rig = read_gltf_rig(builder.save(tmp_path / "in.glb"), drivers=DRIVERS)
    moved = with_units(rig, "cm")
    assert isinstance(moved, Rig)
    values = {"jawOpen": 0.7, "look": 0.4}
    np.testing.assert_allclose(posed(moved, **values), 100 * posed(rig, **values))


def test_pictures_frame_the_face(builder, tmp_path) -> None:
    builder.mesh(np.float32([[0, 0, 0], [0, -2, 0], [0.3, -2, 0]]), {}, name="body")
    rig = read_gltf_rig(builder.save(tmp_path / "in.glb"), drivers=DRIVERS)
    assert np.ptp(rig.whole.vertices[:, 1]) > 2
    take = Take([0, 1], Source(np.zeros((2, 1)), ("a",)), Controls(rig.names), np.zeros((2, 2)))
    face = posed_face(take, rig, "face")
    assert frame_faces([face], [0, 1])[0].reach < 0.12
    assert face.motion.fetch(np.arange(2)).shape == (2, len(rig.whole.vertices), 3)
    assert np.isnan(rig.deform([[np.nan, np.nan]])).any()


def test_nodes_that_can_be_driven_are_listed(builder, tmp_path: Path) -> None:
    from facert.io.formats import nodes_of

    assert nodes_of(builder.save(tmp_path / "in.glb")) == ("eye", "cornea", "stage", "head", "jaw")
