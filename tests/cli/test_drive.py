from dataclasses import replace

import numpy as np
import pytest

import facert as api
from facert.data.rig import Rig
from facert.data.take import Source, Take
from facert.io.formats import write_rig_file
from facert.io.mesh_sequence import open_mesh_sequence
from facert.topology.driving import FaceDriver

VERTICES = [0, 7, 27, 56, 63]


@pytest.fixture
def rig():
    """A sheet of 8 by 8 vertices with two shapes."""
    y, x = np.mgrid[0.0:8.0, 0.0:8.0]
    neutral = np.stack([x, y, 0.2 * np.cos(x) + 0.1 * y], axis=2).reshape(-1, 3)
    corner = (np.arange(7)[:, None] * 8 + np.arange(7)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + 8], axis=1),
            np.stack([corner + 1, corner + 9, corner + 8], axis=1),
        ]
    )
    bump = np.exp(-((neutral[:, :2] - 3.5) ** 2).sum(axis=1))[:, None] * [0.0, 0.0, 1.0]
    return Rig(neutral, np.stack([bump, np.roll(bump, 1, axis=1)]), ["up", "right"], faces, "cm")


@pytest.fixture
def files(rig, tmp_path):
    """A rig, and a take of five points that begins at rest."""
    write_rig_file(rig, tmp_path / "rig.h5")
    steps = 0.05 * np.random.default_rng(0).normal(size=(20, 5, 3)).cumsum(axis=0)
    points = rig.neutral[VERTICES] + steps - steps[0]
    write_points(tmp_path / "points.h5", points)
    return tmp_path / "rig.h5", tmp_path / "points.h5", points


def write_points(path, points, names=tuple(f"v{i}" for i in VERTICES)):
    take = Take(time=np.arange(len(points)) / 30, source=Source(points, names))
    api.write_take(take, path, overwrite=True)


def vertices(path):
    with open_mesh_sequence(path) as sequence:
        return sequence.fetch(np.arange(len(sequence)))


def test_every_frame_is_the_face_that_its_points_ask_for(facert, files, rig, tmp_path):
    mesh, take, points = files
    done = facert("drive", mesh, take, tmp_path / "out.h5")
    assert done.code == 0, done.err
    assert "20 frames of 64 vertices, driven by 5 points" in done.out
    expected = FaceDriver(rig.neutral, rig.faces, np.array(VERTICES)).deform(points)
    np.testing.assert_allclose(vertices(tmp_path / "out.h5"), expected, atol=1e-5)
    np.testing.assert_allclose(expected[:, VERTICES], points, atol=1e-9)


def test_a_map_or_nearness_gives_the_vertices(facert, files, tmp_path):
    mesh, take, points = files
    facert("drive", mesh, take, tmp_path / "out.h5")
    write_points(take, points, ["a", "b", "c", "d", "e"])
    assert facert("drive", mesh, take, tmp_path / "auto.h5", "--auto").code == 0
    np.testing.assert_array_equal(vertices(tmp_path / "auto.h5"), vertices(tmp_path / "out.h5"))
    (tmp_path / "map.toml").write_text("a = 0\nb = 7\nc = 27\nd = 56\ne = 63\n")
    done = facert("drive", mesh, take, tmp_path / "map.h5", "--map", tmp_path / "map.toml")
    assert done.code == 0, done.err
    np.testing.assert_array_equal(vertices(tmp_path / "map.h5"), vertices(tmp_path / "out.h5"))


def test_points_of_another_face_are_carried_over(facert, files, tmp_path):
    mesh, take, points = files
    facert("drive", mesh, take, tmp_path / "out.h5")
    write_points(take, 100.0 * points + 7.0)
    refused = facert("drive", mesh, take, tmp_path / "other.h5")
    assert refused.code == 3
    assert "--fit" in refused.err
    assert facert("drive", mesh, take, tmp_path / "other.h5", "--fit", "uniform").code == 0
    np.testing.assert_allclose(
        vertices(tmp_path / "other.h5"), vertices(tmp_path / "out.h5"), atol=1e-5
    )


def test_a_glb_holds_morph_targets(facert, files, tmp_path):
    mesh, take, _ = files
    done = facert("drive", mesh, take, tmp_path / "out.glb")
    assert done.code == 0, done.err
    assert "morph targets, off by" in done.out
    assert (tmp_path / "out.glb").read_bytes()[:4] == b"glTF"


def test_a_glb_of_a_mesh_without_a_unit_is_warned_of_unless_it_is_given(
    facert, files, rig, tmp_path
):
    _, take, _ = files
    mesh, out = tmp_path / "bare.h5", tmp_path / "out.glb"
    write_rig_file(replace(rig, units=""), mesh)
    assert "--in-units cm" in facert("drive", mesh, take, out).err
    given = facert("drive", mesh, take, out, "--in-units", "cm", "--overwrite")
    assert given.code == 0
    assert "warning" not in given.err
    assert b'"scale":[0.01' in out.read_bytes().replace(b" ", b"")
    assert "warning" not in facert("drive", mesh, take, tmp_path / "out.h5").err
    refused = facert("drive", mesh, take, out, "--in-units", "ell", "--overwrite")
    assert refused.code == 3
    assert "--in-units" in refused.err


@pytest.mark.parametrize(
    ("options", "units", "words"),
    [
        (("--auto", "--fit", "axes"), "cm", ("instead of --auto", "MESH in cm, POINTS in cm")),
        (("--auto",), "", ("--map (or v1204-names) and --fit", "POINTS in no unit")),
        (("--auto", "--fit", "axes"), "m", ("convert --units cm", "POINTS in m")),
        ((), "cm", ("add --fit", "MESH in cm")),
    ],
)
def test_points_far_from_the_mesh_are_refused_with_what_would_help(
    facert, files, tmp_path, options, units, words
):
    mesh, take, points = files
    moved = Take(
        time=np.arange(20) / 30,
        source=Source(points + 90.0, [f"v{i}" for i in VERTICES]),
        units=units,
    )
    api.write_take(moved, take, overwrite=True)
    done = facert("drive", mesh, take, tmp_path / "out.h5", *options)
    assert done.code == 3
    for word in words:
        assert word in done.err


def test_a_larger_tolerance_makes_a_smaller_glb(facert, files, tmp_path):
    mesh, take, _ = files
    sizes = []
    for tolerance in (0.01, 30):
        out = tmp_path / f"{tolerance}.glb"
        done = facert("drive", mesh, take, out, "--tolerance", tolerance)
        assert done.code == 0, done.err
        sizes.append(out.stat().st_size)
    assert sizes[1] < 0.7 * sizes[0]
    assert facert("drive", mesh, take, tmp_path / "a.glb", "--tolerance", -1).code == 2


def test_parts_without_a_point_are_refused_or_carried(facert, files, rig, tmp_path):
    _, take, _ = files
    far = rig.neutral + np.array([0.0, 0.0, 5.0])
    two = Rig(
        np.concatenate([rig.neutral, far]),
        np.concatenate([rig.shapes, rig.shapes], axis=1),
        rig.names,
        np.concatenate([rig.faces, rig.faces + 64]),
    )
    write_rig_file(two, tmp_path / "two.h5")
    refused = facert("drive", tmp_path / "two.h5", take, tmp_path / "out.h5")
    assert refused.code == 3
    assert "--carry" in refused.err
    assert facert("drive", tmp_path / "two.h5", take, tmp_path / "out.h5", "--carry").code == 0
    assert vertices(tmp_path / "out.h5").shape == (20, 128, 3)


@pytest.mark.parametrize(
    ("options", "code", "word"),
    [
        (("--method", "magic"), 3, "one of smooth"),
        (("--rest", "99"), 3, "--rest"),
        (("--auto", "--map", "map.toml"), 2, "not both"),
        (("--map", "nowhere.toml"), 3, "nowhere.toml"),
    ],
)
def test_bad_options_are_named_and_nothing_is_written(facert, files, tmp_path, options, code, word):
    mesh, take, _ = files
    done = facert("drive", mesh, take, tmp_path / "out.h5", *options)
    assert done.code == code
    assert word in done.err
    assert not (tmp_path / "out.h5").exists()


def test_names_that_cannot_be_written_are_refused_first(facert, files, tmp_path):
    mesh, take, _ = files
    assert ".glb" in facert("drive", mesh, take, tmp_path / "out.obj").err
    assert facert("drive", mesh, take, take).code == 2


def test_suggested_points_are_vertices_for_simulate(facert, files, rig, tmp_path):
    mesh, _, _ = files
    picture = tmp_path / "points.png"
    done = facert("points", "suggest", mesh, "-n", 12, "--picture", picture)
    assert done.code == 0, done.err
    *table, last = [line for line in done.out.splitlines() if line.strip()]
    chosen = [int(vertex) for vertex in last.split(",")]
    rows = [line.split() for line in table[-12:]]
    assert [(int(row[0]), int(row[1])) for row in rows] == list(enumerate(chosen, start=1))
    np.testing.assert_allclose(
        [[float(place) for place in row[2:5]] for row in rows], rig.neutral[chosen], rtol=1e-3
    )
    assert len(set(chosen)) == 12
    assert max(chosen) < 64
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert facert("points", "suggest", mesh, "-n", 12, "--picture", picture).code == 2
    assert facert("points", "suggest", mesh, "-n", 100).code == 3
