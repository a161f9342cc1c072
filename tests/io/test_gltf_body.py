"""What a character has beside its shapes is shown around the face, and follows driven nodes."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pygltflib as gltf
import pytest
from gltf_files import EYE, FACE, Builder, character
from PIL import Image
from scipy.spatial.transform import Rotation

from facert import Controls, Source, Take
from facert.data.drivers import Drivers
from facert.data.rig import CLAY, Rig
from facert.data.units import with_units
from facert.io.gltf.rig import read_gltf_rig
from facert.render.faces import frame_faces, posed_face

AT, DOWN = np.array([0.05, 0.1, 0.01]), np.array([0, -0.02, 0])
DRIVERS = Drivers.of(
    {
        "look": {"node": "eye", "rotate": [0, 0, 90]},
        "jawOpen": {"node": "jaw", "rotate": [30, 0, 0], "translate": [0, -0.01, 0]},
    }
)


@pytest.fixture(name="builder")
def _builder() -> Builder:
    return character(unused=9)


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


def test_a_texture_gives_its_colours_and_a_bad_one_clay(builder, tmp_path) -> None:
    picture = BytesIO()
    Image.fromarray(np.uint8([[[0, 0, 255], [0, 255, 0]], [[9, 9, 9], [255, 0, 0]]])).save(
        picture, "PNG"
    )
    document, content = builder.document, np.frombuffer(picture.getvalue(), np.uint8)
    uv = np.float32([[0.2, 0.2, 0], [0.7, 0.2, 0], [1.7, -0.1, 0]])
    document.meshes[2].primitives[0].attributes.TEXCOORD_0 = builder.accessor(uv)
    surface = document.materials[0].pbrMetallicRoughness
    surface.baseColorTexture = gltf.TextureInfo(index=0)
    surface.baseColorFactor = None
    document.textures = [gltf.Texture(source=0)]
    document.images = [gltf.Image(bufferView=builder.view(content), mimeType="image/png")]
    rig = read_gltf_rig(builder.save(tmp_path / "in.glb"))
    np.testing.assert_allclose(rig.whole.colours[6:], [[0, 0, 1], [0, 1, 0], [1, 0, 0]], atol=1e-6)
    document.images = [gltf.Image(uri="data:image/png;base64,AAAA")]
    bad = read_gltf_rig(builder.save(tmp_path / "bad.glb"))
    np.testing.assert_allclose(bad.whole.colours[6:], [CLAY] * 3)


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
