import numpy as np
import pytest

from facert.errors import InputError
from facert.io.obj import read_obj, read_obj_folder

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    "face",
    ["f 1 2 3 4", "f 1/5 2/6 3/7 4/8", "f 1//1 2//1 3//1 4//1", "f 1/1/1 2/2/1 3/3/1 4/4/1",
     "f -4 -3 -2 -1"],
)  # fmt: skip
def test_polygons_become_triangle_fans_in_every_form_of_a_corner(tmp_path, face):
    path = tmp_path / "mesh.obj"
    path.write_text(f"# comment\no face\n{SQUARE}vt 0 0\nvn 0 0 1\n\n{face}\n")
    mesh = read_obj(path)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    np.testing.assert_array_equal(mesh.vertices[2], [1, 1, 0])


def test_negative_corners_count_from_the_vertices_so_far(tmp_path):
    path = tmp_path / "mesh.obj"
    path.write_text("v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\n")
    assert read_obj(path).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    "line",
    ["v 0 0", "v a b c", "f 1 2", "f 1 2 0", "f -9 1 2", "f x 1 2", f"f 1 2 {'9' * 30}"],
)
def test_a_broken_line_is_named(tmp_path, line):
    path = tmp_path / "mesh.obj"
    path.write_text(f"{SQUARE}{line}\n")
    with pytest.raises(InputError, match=r"mesh\.obj: line 5"):
        read_obj(path)


def test_a_folder_is_a_rig_of_displacements(tmp_path):
    (tmp_path / "Neutral.obj").write_text(f"{SQUARE}f 1 2 3 4\n")
    (tmp_path / "smile_L.obj").write_text(SQUARE.replace("v 1 1 0", "v 1 1 2"))
    (tmp_path / "frown.OBJ").write_text(f"{SQUARE}f 1 2 3 4\n")
    (tmp_path / "notes.txt").write_text("not a mesh")
    rig = read_obj_folder(tmp_path)
    assert rig.names == ("frown", "smile_L")
    assert np.argwhere(rig.shapes).tolist() == [[1, 2, 2]]
    assert rig.shapes[1, 2, 2] == 2.0
    assert len(rig.faces) == 2


def test_shapes_of_another_mesh_are_refused(tmp_path):
    (tmp_path / "neutral.obj").write_text(f"{SQUARE}f 1 2 3 4\n")
    (tmp_path / "smile.obj").write_text("v 0 0 0\n")
    with pytest.raises(InputError, match=r"smile\.obj: vertices: expected 4"):
        read_obj_folder(tmp_path)


def test_shapes_with_other_faces_are_logged(tmp_path, caplog):
    (tmp_path / "neutral.obj").write_text(f"{SQUARE}f 1 2 3 4\n")
    (tmp_path / "smile.obj").write_text(f"{SQUARE}f 2 3 4 1\n")
    read_obj_folder(tmp_path)
    assert "vertex order" in caplog.text


def test_a_folder_without_a_neutral_or_shapes_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"neutral\.obj"):
        read_obj_folder(tmp_path)
    (tmp_path / "neutral.obj").write_text(f"{SQUARE}f 1 2 9\n")
    with pytest.raises(InputError, match="one OBJ file a shape"):
        read_obj_folder(tmp_path)
    (tmp_path / "smile.obj").write_text(SQUARE)
    with pytest.raises(InputError, match="/faces"):
        read_obj_folder(tmp_path)


def test_names_in_an_old_encoding_are_no_harm(tmp_path):
    path = tmp_path / "mesh.obj"
    path.write_bytes(f"o M\xfcller\n{SQUARE}f 1 2 3\n".encode("latin-1"))
    assert len(read_obj(path).vertices) == 4


def test_vertices_of_any_length_and_blanks_are_read(tmp_path):
    path = tmp_path / "mesh.obj"
    path.write_text("  v 0 0 0 1 .5 .5\nv\t1  0 0\nv 1e0 1 0 1\nvn 0 0 1\nv 0 1 0\nf 1 2 3 4\n")
    plain = tmp_path / "plain.obj"
    plain.write_text(f"{SQUARE}f 1 2 3 4\n")
    assert np.array_equal(read_obj(path).vertices, read_obj(plain).vertices)
    assert read_obj(path).faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_the_files_of_a_folder_share_one_account_of_memory(tmp_path, monkeypatch):
    monkeypatch.setenv("FACERT_MAX_MEMORY", "1M")
    for name in ("neutral", *(f"s{i}" for i in range(8))):
        (tmp_path / f"{name}.obj").write_text("v 0 0 1\n" * 2000 + "f 1 2 3\n")
    assert len(read_obj(tmp_path / "neutral.obj").vertices) == 2000
    with pytest.raises(InputError, match=r"s\d.obj: vertices: expected at most 1 MiB"):
        read_obj_folder(tmp_path)
