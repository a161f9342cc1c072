"""Faces in motion can be looked into and carried to other programs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from facert.data import Controls, MeshSequence, Rig, Source, Take
from facert.io.mesh_sequence import write_mesh_sequence
from facert.io.rig import write_rig
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
    assert "24 frames of 1 morph targets" in outcome.out
    assert trimesh.load_scene(folder / "face.glb").extents[0] == pytest.approx(0.02)


def test_a_take_becomes_a_glb_of_the_shapes_that_it_moves(facert, folder: Path) -> None:
    outcome = facert("convert", folder / "take.h5", folder / "a.glb", "--rig", folder / "rig.h5")
    assert "24 frames of 1 morph targets" in outcome.out
    assert b'"targetNames":["up"]' in (folder / "a.glb").read_bytes()


def test_a_take_without_a_rig_is_no_glb(facert, folder: Path) -> None:
    outcome = facert("convert", folder / "take.h5", folder / "a.glb")
    assert (outcome.code, "--rig" in outcome.err) == (3, True)
