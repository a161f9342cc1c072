"""Meshes come in from OBJ, PLY and rigs, alike; PLY files are hostile until read."""

import time
from contextlib import suppress

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.rig import Mesh, Rig
from facert.errors import InputError
from facert.io.formats import read_mesh
from facert.io.ply import read_ply
from facert.io.rig import write_rig

VERTICES = np.random.default_rng(0).normal(size=(5, 3))
FACES = np.array([[0, 1, 2], [2, 3, 4], [4, 0, 2]])
COLOURS = np.array([[0, 51, 255]] * 5) / 255
QUAD = """ply
format ascii 1.0
comment a quad and a triangle
element vertex 5
property double x
property double y
property double z
property float confidence
element edge 1
property int from
property int to
element face 2
property uchar flag
property list uchar int vertex_indices
end_header
0 0 0 1
1 0 0 1
1 1 0 1
0 1 0 1
2 0.5 0 1
0 1
7 4 0 1 2 3
7 3 1 4 2
"""


def test_many_faces_of_several_sizes_are_read_at_once_and_in_order(tmp_path):
    """One by one, each with a layout of its own, a file of 30 MB took half a minute."""
    path, count = tmp_path / "mesh.ply", 100_000
    header = (
        "ply\nformat binary_big_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {count}\nproperty uchar flag\n"
        "property list uchar int vertex_indices\nproperty list ushort float uv\nend_header\n"
    )
    three = b"\7\3" + np.array([0, 1, 2], ">i4").tobytes() + b"\0\1" + bytes(4)
    four = b"\7\4" + np.array([3, 2, 1, 0], ">i4").tobytes() + b"\0\0"
    corners = np.arange(12, dtype=">f4").tobytes()
    path.write_bytes(header.encode() + corners + (three + four) * (count // 2))
    begin = time.process_time()
    faces = read_ply(path).faces
    assert time.process_time() - begin < 1.5
    np.testing.assert_array_equal(faces[:6], [[0, 1, 2], [3, 2, 1], [3, 1, 0]] * 2)
    assert len(faces) == 3 * count // 2


def exported(encoding, colours=False):
    extra = {"vertex_colors": np.c_[COLOURS * 255, np.full(5, 255)].astype(np.uint8)}
    mesh = trimesh.Trimesh(VERTICES, FACES, process=False, **(extra if colours else {}))
    return trimesh.exchange.ply.export_ply(mesh, encoding=encoding)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_a_ply_file_of_another_library_holds_the_same_mesh(tmp_path, encoding):
    path = tmp_path / "mesh.ply"
    path.write_bytes(exported(encoding, colours=True))
    mesh = read_mesh(path)
    np.testing.assert_allclose(mesh.vertices, VERTICES, atol=1e-6)
    np.testing.assert_array_equal(mesh.faces, FACES)
    np.testing.assert_allclose(mesh.colours, COLOURS)


def test_polygons_of_different_sizes_become_fans_among_other_elements(tmp_path):
    path = tmp_path / "mesh.ply"
    path.write_text(QUAD)
    mesh = read_ply(path)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    assert mesh.vertices[4].tolist() == [2, 0.5, 0]
    assert mesh.colours is None


def test_the_byte_order_of_the_header_holds(tmp_path):
    path = tmp_path / "mesh.ply"
    header = QUAD.replace("ascii", "binary_big_endian").split("element face")[0]
    header = header.replace("element edge 1\nproperty int from\nproperty int to\n", "")
    rows = np.c_[VERTICES, np.ones(5)]
    dtype = np.dtype([("xyz", ">f8", 3), ("confidence", ">f4")])
    body = np.array([(row[:3], row[3]) for row in rows], dtype).tobytes()
    path.write_bytes((header + "end_header\n").encode() + body)
    np.testing.assert_array_equal(read_ply(path).vertices, VERTICES)


def test_every_kind_of_file_gives_the_same_mesh(tmp_path):
    rig, obj, ply = (tmp_path / f"face.{ending}" for ending in ("h5", "obj", "ply"))
    write_rig(Rig(VERTICES, np.ones((1, 5, 3)), ("up",), FACES), rig)
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in VERTICES]
    lines += [f"f {a} {b} {c}" for a, b, c in FACES + 1]
    obj.write_text("\n".join(lines))
    ply.write_bytes(exported("binary"))
    for path in (rig, obj, ply):
        mesh = read_mesh(path)
        np.testing.assert_allclose(mesh.vertices, VERTICES, atol=1e-6)
        np.testing.assert_array_equal(mesh.faces, FACES)


HOSTILE = {
    "no header": QUAD.replace("end_header", "end"),
    "not a ply": "solid\n" + QUAD,
    "a type that is none": QUAD.replace("float confidence", "quad confidence"),
    "a property before any element": QUAD.replace("comment a", "property int x\ncomment a"),
    "an order that is none": QUAD.replace("ascii", "middle_endian"),
    "a negative count": QUAD.replace("vertex 5", "vertex -5"),
    "more rows than there are": QUAD.replace("face 2", "face 3"),
    "a huge count": QUAD.replace("vertex 5", "vertex 999999999999"),
    "a huge count of lists": QUAD.replace("face 2", "face 999999999999"),
    "a huge list": QUAD.replace("7 4 0 1 2 3", "7 1e300 0 1 2 3"),
    "a negative list": QUAD.replace("7 4 0 1 2 3", "7 -1 0 1 2 3"),
    "an infinite list": QUAD.replace("7 4 0 1 2 3", "7 inf 0 1 2 3"),
    "words": QUAD.replace("2 0.5 0 1", "2 half 0 1"),
    "a vertex at NaN": QUAD.replace("2 0.5 0 1", "2 nan 0 1"),
    "a corner that is no vertex": QUAD.replace("7 3 1 4 2", "7 3 1 5 2"),
    "a corner at NaN": QUAD.replace("7 3 1 4 2", "7 3 1 nan 2"),
    "a face with two corners": QUAD.replace("7 3 1 4 2", "7 2 1 4"),
    "no coordinates": QUAD.replace("double z", "double w"),
    "one name twice": QUAD.replace("float confidence", "float x"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_broken_ply_file_is_refused(tmp_path, name):
    path = tmp_path / "mesh.ply"
    path.write_text(HOSTILE[name])
    with pytest.raises(InputError) as caught:
        read_mesh(path)
    assert str(caught.value).startswith(f"{path}: ")


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_no_damage_to_a_ply_file_does_more_than_an_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("ply") / "mesh.ply"
    content = bytearray(exported("binary"))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    with suppress(InputError):
        assert isinstance(read_ply(path), Mesh)


def test_an_unknown_ending_is_refused(tmp_path):
    path = tmp_path / "face.stl"
    path.write_text("solid")
    with pytest.raises(InputError, match="ending"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros((4, 2)), FACES), "/neutral"),
        ((VERTICES * np.nan, FACES), "/neutral: expected finite"),
        ((VERTICES, FACES * 1.0), "/faces: expected integers"),
        ((VERTICES, FACES + 1), "/faces: expected vertex indices 0 to 4"),
        ((VERTICES, FACES, "cm", np.full((5, 3), 2.0)), "/colours"),
    ],
)
def test_a_mesh_checks_itself(arguments, message):
    with pytest.raises(InputError, match=message):
        Mesh(*arguments)
