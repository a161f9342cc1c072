"""Faces in motion can be looked into and carried to other programs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from facert.data.rig import MeshSequence, Rig
from facert.data.take import Controls, Source, Take
from facert.io.gltf.rig import read_gltf_mesh
from facert.io.mesh_sequence import write_mesh_sequence
from facert.io.rig import read_rig, write_rig
from facert.io.take import write_take

VERTICES = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
SHAPES = np.stack([VERTICES * 0.5, VERTICES * 0 + 1])
RIG = Rig(VERTICES, SHAPES, ("up", "away"), np.array([[0, 1, 2], [0, 2, 3]]), "cm")
PARAMS = np.sin(np.linspace(0, 3, 24))[:, None]
TIME = np.arange(24) / 24
SEQUENCE = MeshSequence(RIG.mesh, TIME, lambda rows: VERTICES * (1 + 0.5 * PARAMS[rows, None]))


@pytest.fixture(name="folder")
def _folder(tmp_path: Path) -> Path:
    write_rig(RIG, tmp_path / "rig.h5")
    source = Source(np.ones((24, 3)), ("a", "b", "c"))
    write_take(
        Take(time=TIME, source=source, controls=Controls(("up",)), params=PARAMS),
        tmp_path / "take.h5",
    )
    write_mesh_sequence(SEQUENCE, tmp_path / "face.h5")
    return tmp_path


def test_a_mesh_sequence_is_summed_up(facert, folder: Path) -> None:
    facts = json.loads(facert("inspect", folder / "face.h5", "--json").out)
    assert (facts["kind"], facts["frames"], facts["vertices"]) == ("mesh sequence", 24, 4)
    assert facts["largest_displacement"] == pytest.approx(0.5 * np.sqrt(2) * PARAMS.max())


def test_a_mesh_sequence_becomes_a_glb(facert, folder: Path) -> None:
    outcome = facert("convert", folder / "face.h5", folder / "face.glb")
    assert "24 frames of 1 morph target" in outcome.out
    assert trimesh.load_scene(folder / "face.glb").extents[0] == pytest.approx(0.02)


def test_a_take_becomes_a_glb_of_all_shapes(facert, folder: Path) -> None:
    outcome = facert("convert", folder / "take.h5", folder / "a.glb", "--rig", folder / "rig.h5")
    assert "24 frames of 2 morph targets" in outcome.out
    assert b'"targetNames":["up","away"]' in (folder / "a.glb").read_bytes()


def test_a_take_becomes_usd(facert, folder: Path) -> None:
    pytest.importorskip("pxr", reason="needs usd-core")
    arguments = ("convert", folder / "take.h5", folder / "a.usda", "--rig", folder / "rig.h5")
    assert "24 frames of 1 morph target" in facert(*arguments).out
    assert 'def BlendShape "up"' in (folder / "a.usda").read_text()
    assert facert("convert", folder / "face.h5", folder / "face.usdc").code == 0


def test_a_rig_becomes_a_glb_and_comes_back(facert, folder: Path) -> None:
    assert facert("convert", folder / "rig.h5", folder / "rig.glb").code == 0
    assert facert("convert", folder / "rig.glb", folder / "back.h5", "--units", "cm").code == 0
    back = read_rig(folder / "back.h5")
    np.testing.assert_allclose(back.neutral, RIG.neutral, atol=1e-6)
    np.testing.assert_allclose(back.shapes, RIG.shapes, atol=1e-6)
    assert (back.names, back.units) == (RIG.names, "cm")


def test_an_animated_glb_is_a_rig_or_a_take(facert, folder: Path) -> None:
    glb = folder / "a.glb"
    facert("convert", folder / "take.h5", glb, "--rig", folder / "rig.h5")
    assert "a rig" in facert("convert", glb, folder / "b.h5").out
    assert "a take" in facert("convert", glb, folder / "c.h5", "--kind", "take").out
    assert "24 frames of 2 weights" in facert("convert", glb, folder / "c.json").out
    assert "24 frames" in facert("convert", glb, folder / "d.glb", "--rig", glb).out


def test_tracked_weights_move_a_rig_of_their_names(facert, folder: Path) -> None:
    (folder / "face.csv").write_text("time,Up,headYaw\n0,0.5,9\n0.1,,9\n0.2,1,9\n")
    arguments = ("convert", folder / "face.csv", folder / "e.glb", "--rig", folder / "rig.h5")
    done = facert(*arguments)
    assert "2 frames of 2 morph targets" in done.out
    assert "no shape for 1 weight, left out: headYaw" in done.err


def test_options_for_takes_are_refused_for_a_mesh_sequence(facert, folder: Path) -> None:
    refused = facert("convert", folder / "face.h5", folder / "a.glb", "--fps", "10")
    assert (refused.code, "a mesh sequence" in refused.err) == (3, True)
    assert facert("convert", folder / "face.h5", folder / "b.h5").code == 3


def test_a_take_without_a_rig_is_no_glb(facert, folder: Path) -> None:
    outcome = facert("convert", folder / "take.h5", folder / "a.glb")
    assert (outcome.code, "--rig" in outcome.err) == (3, True)


@pytest.mark.parametrize(
    ("unit", "options", "width"),
    [
        ("mm", (), 0.002),
        ("centimetres", (), 0.02),
        ("", ("--in-units", "cm"), 0.02),
        ("", ("--in-units", "mm", "--units", "m"), 0.002),
        ("cm", ("--units", "mm"), 0.02),
    ],
)
def test_a_glb_is_as_large_as_the_face_in_metres(
    facert, folder: Path, unit: str, options: tuple[str, ...], width: float
) -> None:
    """Whatever unit the numbers of the rig are in, and whether it moves."""
    rig, out = folder / "unit.h5", folder / "out.glb"
    write_rig(replace(RIG, units=unit), rig)
    for given in ((rig,), (folder / "take.h5", "--rig", rig)):
        done = facert("convert", given[0], out, *given[1:], *options, "--overwrite")
        assert done.code == 0, done.err
        assert read_gltf_mesh(out).vertices[:, 0].max() == pytest.approx(width / 2)
        assert "does not say its unit" not in done.err or "--units" in options


def test_a_glb_of_numbers_without_a_unit_is_warned_of(facert, folder: Path) -> None:
    write_rig(replace(RIG, units=""), folder / "unit.h5")
    done = facert("convert", folder / "unit.h5", folder / "out.glb")
    assert done.code == 0
    assert "--in-units cm" in done.err


def test_what_in_holds_is_not_that_of_a_rig_that_knows_its_unit(facert, folder: Path) -> None:
    rig, out = folder / "unit.h5", folder / "out.glb"
    write_rig(replace(RIG, units="cm"), rig)
    options = ("--rig", rig, "--in-units", "mm", "--in-up-axis", "z", "--up-axis", "y")
    assert facert("convert", folder / "take.h5", out, *options).code == 0
    assert read_gltf_mesh(out).vertices.max(axis=0) == pytest.approx(RIG.neutral.max(axis=0) / 100)
    assert facert("convert", rig, out, "--in-units", "m", "--overwrite").code == 0
    assert read_gltf_mesh(out).vertices.max(axis=0) == pytest.approx(RIG.neutral.max(axis=0))
