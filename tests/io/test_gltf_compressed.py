"""Quantised numbers and compressed buffers come out at the right size; damage is one error."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import meshopt
import numpy as np
import pygltflib as gltf
import pytest
from gltf_files import Builder, glb
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.errors import InputError
from facert.io.gltf.rig import read_gltf_rig

RNG = np.random.default_rng(0)
HEAD = np.float32(RNG.random((39, 3)) * [0.2, 0.3, 0.2] + [-0.1, 1.5, 0])
JAW = np.float32(RNG.random((39, 3)) * 0.03)
FACES = np.uint32([[i, i + 1, i + 2] for i in range(37)])
BOTH = ["EXT_meshopt_compression", "KHR_meshopt_compression"]


def padded(values: np.ndarray) -> np.ndarray:
    """Rows (n, 4), as rows of a compressed view are a multiple of four bytes."""
    return np.concatenate([values, np.zeros((len(values), 1), values.dtype)], axis=1)


def compress(
    builder: Builder,
    rows: np.ndarray,
    extension: str = BOTH[0],
    encoding: str = "ATTRIBUTES",
    content: bytes | None = None,
    **others: Any,
) -> int:
    """A view whose bytes are in the file only as compressed ones; its fallback buffer is not."""
    packed = meshopt.encode_gltf_buffer(rows, encoding) if content is None else content
    rows = rows if encoding == "ATTRIBUTES" else rows.reshape(-1, 1)
    place = {
        "buffer": 0,
        "byteOffset": len(builder.content),
        "byteLength": len(packed),
        "byteStride": rows.nbytes // len(rows),
        "count": len(rows),
        "mode": encoding,
    }
    builder.content += packed + b"\0" * (-len(packed) % 4)
    view = gltf.BufferView(
        buffer=1,
        byteLength=rows.nbytes,
        byteStride=rows.nbytes // len(rows) if encoding == "ATTRIBUTES" else None,
        extensions={extension: place | others},
    )
    builder.document.bufferViews.append(view)
    return len(builder.document.bufferViews) - 1


def save(builder: Builder, path: Path, extension: str = BOTH[0]) -> Path:
    root = json.loads(builder.document.to_json())
    absent = {"byteLength": 10**6, "extensions": {extension: {"fallback": True}}}
    root["buffers"] = [{"byteLength": len(builder.content)}, absent]
    root["extensionsRequired"] = [extension, "KHR_mesh_quantization"]
    path.write_bytes(glb(root, builder.content))
    return path


def compressed_face(extension: str = BOTH[0], **others: Any) -> Builder:
    builder = Builder()
    place = builder.accessor(HEAD, bufferView=compress(builder, padded(HEAD), extension, **others))
    jaw = builder.accessor(JAW, bufferView=compress(builder, padded(JAW), extension))
    builder.mesh(place, {"jawOpen": jaw})
    view = compress(builder, FACES.ravel(), extension, "TRIANGLES")
    faces = builder.accessor(FACES.ravel(), bufferView=view)
    builder.document.meshes[0].primitives[0].indices = faces
    return builder


@pytest.mark.parametrize("extension", BOTH)
def test_attributes_and_triangles_are_decompressed(tmp_path: Path, extension: str) -> None:
    rig = read_gltf_rig(save(compressed_face(extension), tmp_path / "face.glb", extension))
    np.testing.assert_array_equal(rig.neutral, HEAD)
    np.testing.assert_array_equal(rig.shapes[0], JAW)
    turned = {tuple(np.roll(face, -int(face.argmin()))) for face in rig.faces}
    assert turned == {tuple(face) for face in FACES}


def test_a_sequence_of_indices_of_two_bytes_is_decompressed(tmp_path: Path) -> None:
    builder = compressed_face()
    indices = np.uint16(FACES.ravel())
    view = compress(builder, indices, encoding="INDICES")
    builder.document.meshes[0].primitives[0].indices = builder.accessor(indices, bufferView=view)
    rig = read_gltf_rig(save(builder, tmp_path / "face.glb"))
    np.testing.assert_array_equal(rig.faces, FACES)


def test_the_exponential_filter_is_undone(tmp_path: Path) -> None:
    builder = Builder()
    rows = meshopt.encode_filter_exp(HEAD, 20)
    view = compress(builder, rows, filter="EXPONENTIAL")
    builder.mesh(builder.accessor(HEAD, bufferView=view), {"jawOpen": JAW})
    rig = read_gltf_rig(save(builder, tmp_path / "face.glb"))
    np.testing.assert_allclose(rig.neutral, HEAD, atol=2e-6)


@pytest.mark.parametrize("normalised", [False, True])
@pytest.mark.parametrize("dtype", [np.uint16, np.int16, np.uint8, np.int8])
def test_quantised_numbers_take_their_size_from_the_node(tmp_path, dtype, normalised) -> None:
    builder = Builder()
    most = np.iinfo(dtype).max
    low, size = HEAD.min(axis=0), 0.3
    whole = np.rint((HEAD - low) / size * most).astype(dtype)
    shape = np.rint(JAW / size * most).astype(dtype)
    step = size / (1 if normalised else most)
    moved = builder.accessor(shape, normalized=normalised)
    builder.mesh(
        builder.accessor(whole, normalized=normalised),
        {"jawOpen": moved},
        translation=low.tolist(),
        scale=[step] * 3,
    )
    rig = read_gltf_rig(builder.save(tmp_path / "face.glb"))
    kept = np.unique(np.concatenate([whole, shape], axis=1), axis=0, return_index=True)[1]
    np.testing.assert_allclose(rig.neutral, HEAD[np.sort(kept)], atol=0.6 * size / most)
    np.testing.assert_allclose(rig.shapes[0], JAW[np.sort(kept)], atol=0.6 * size / most)


@pytest.mark.parametrize("normalised", [False, True])
def test_quantised_numbers_take_their_size_from_inverse_bind_matrices(tmp_path, normalised) -> None:
    builder = Builder()
    low, size, most = HEAD.min(axis=0), 0.3, 65535
    whole = np.rint((HEAD - low) / size * most).astype(np.uint16)
    shape = np.rint(JAW / size * most).astype(np.uint16)
    inverse = np.eye(4)
    inverse[:3, :3] *= size / (1 if normalised else most)
    inverse[:3, 3] = low
    attributes = {
        "JOINTS_0": builder.accessor(np.zeros((39, 4), np.uint8)),
        "WEIGHTS_0": builder.accessor(np.uint8([[255, 0, 0, 0]] * 39), normalized=True),
    }
    place = builder.accessor(padded(whole)[:, :3].copy(), normalized=normalised)
    moved = builder.accessor(shape, normalized=normalised)
    skin = builder.skin([builder.joint()], inverse[None])
    builder.mesh(place, {"jawOpen": moved}, attributes, skin=skin, scale=[9.0] * 3)
    rig = read_gltf_rig(builder.save(tmp_path / "face.glb"))
    np.testing.assert_allclose(rig.neutral, HEAD, atol=1e-5)
    np.testing.assert_allclose(rig.shapes[0], JAW, atol=1e-5)


def test_a_sparse_target_changes_quantised_numbers_out_of_a_compressed_view(tmp_path: Path) -> None:
    builder = Builder()
    base = padded(np.tile(np.int16([0, 100, 0]), (39, 1)))
    places = builder.view(np.uint8([7, 3, 0, 0]))
    moves = compress(builder, padded(np.int16([[0, 0, 500], [9, 0, 0]])).reshape(1, -1))
    sparse = gltf.Sparse(
        count=2,
        indices=gltf.AccessorSparseIndices(bufferView=places, componentType=5121),
        values=gltf.AccessorSparseValues(bufferView=moves),
    )
    builder.document.bufferViews[moves].byteStride = 8
    number = builder.accessor(base[:, :3].copy(), bufferView=compress(builder, base), sparse=sparse)
    builder.mesh(HEAD, {"lift": number}, scale=[0.001] * 3)
    rig = read_gltf_rig(save(builder, tmp_path / "face.glb"))
    np.testing.assert_allclose(rig.shapes[0][7], [0, 0, 0.5])
    np.testing.assert_allclose(rig.shapes[0][3], [0.009, 0, 0])
    np.testing.assert_allclose(rig.shapes[0][0], [0, 0.1, 0])


@pytest.mark.parametrize(
    "hostile",
    [
        {"count": 10**9},
        {"count": 10**15},
        {"count": -1},
        {"count": 40},
        {"count": "x"},
        {"count": 0},
        {"byteStride": 0},
        {"byteStride": 10**9},
        {"byteStride": 15},
        {"byteStride": 12},
        {"mode": "TRIANGLES"},
        {"mode": "OTHER"},
        {"filter": "OCTAHEDRAL"},
        {"filter": "OTHER"},
        {"buffer": 9},
        {"byteOffset": 10**9},
        {"byteLength": 10},
        {"byteLength": -10},
        {"content": b"\xa0" * 40},
        {"content": b"\xa1" + b"\0" * 200},
        {"content": b""},
    ],
)
def test_hostile_compression_is_one_error(tmp_path: Path, hostile: dict[str, Any]) -> None:
    path = save(compressed_face(**hostile), tmp_path / "face.glb")
    with pytest.raises(InputError) as caught:
        read_gltf_rig(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_draco_is_refused_with_a_way_out(tmp_path: Path) -> None:
    path = save(compressed_face(), tmp_path / "face.glb", "KHR_draco_mesh_compression")
    with pytest.raises(InputError, match="no Draco compression") as caught:
        read_gltf_rig(path)
    assert "without Compression" in str(caught.value)


def test_draco_that_is_not_declared_as_required_is_refused_all_the_same(tmp_path: Path) -> None:
    builder = Builder()
    builder.mesh(builder.accessor(HEAD, bufferView=None), {"jawOpen": JAW})
    packed = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    builder.document.meshes[0].primitives[0].extensions = packed
    path = builder.save(tmp_path / "face.glb")
    with pytest.raises(InputError, match="no Draco compression"):
        read_gltf_rig(path)
    builder.document.accessors[0].bufferView = builder.view(HEAD)
    np.testing.assert_array_equal(read_gltf_rig(builder.save(path)).neutral, HEAD)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=6))
def test_damaged_streams_give_a_face_or_one_error(tmp_path_factory, changes) -> None:
    builder = compressed_face()
    content = bytearray(builder.content)
    for place, value in changes:
        content[place % len(content)] = value
    builder.content = bytes(content)
    path = save(builder, tmp_path_factory.getbasetemp() / "damaged.glb")
    with suppress(InputError):
        assert read_gltf_rig(path) is not None
