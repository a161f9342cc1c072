"""The names of morph targets are found wherever a writer put them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import Builder

from facert.errors import InputError
from facert.io.gltf.rig import read_gltf_mesh, read_gltf_rig
from facert.io.gltf.take import read_gltf_take

TRIANGLE = np.eye(3, dtype=np.float32)
SMILE, BLINK = np.float32([[0, 1, 0]] * 3), np.float32([[0, 0, 2]] * 3)
NAMES = ["jawOpen", "mouthPucker"]


def nameless(builder: Builder, *meshes: str | None) -> Builder:
    for number, name in enumerate(meshes):
        moved = {"smile": SMILE * (1 + number), "blink": BLINK * (1 + number)}
        builder.mesh(TRIANGLE + 2 * number, moved)
        builder.document.meshes[-1].extras, builder.document.meshes[-1].name = {}, name
    return builder


def in_mesh(document: Any) -> None:
    document.meshes[0].extras = {"targetNames": NAMES, "other": 3}


def with_basis(document: Any) -> None:
    document.meshes[0].extras = {"targetNames": ["Basis", *NAMES]}


def in_primitive(document: Any) -> None:
    document.meshes[0].extras = None
    document.meshes[0].primitives[0].extras = {"targetNames": NAMES}


def in_primitive_rather_than_in_a_mesh_of_other_names(document: Any) -> None:
    document.meshes[0].extras = {"targetNames": ["of another mesh"]}
    document.meshes[0].primitives[0].extras = {"targetNames": NAMES}


def under_another_key(document: Any) -> None:
    document.meshes[0].extras = {"morphTargetNames": NAMES}


def under_a_key_of_two_words(document: Any) -> None:
    document.meshes[0].extras = {"target_names": NAMES}


def in_each_target(document: Any) -> None:
    for target, name in zip(document.meshes[0].primitives[0].targets, NAMES, strict=True):
        target["extras"] = {"name": name}


def in_accessors(document: Any) -> None:
    for target, name in zip(document.meshes[0].primitives[0].targets, NAMES, strict=True):
        document.accessors[target["POSITION"]].name = name


def in_extras_of_accessors(document: Any) -> None:
    for target, name in zip(document.meshes[0].primitives[0].targets, NAMES, strict=True):
        document.accessors[target["POSITION"]].extras = {"name": name}


@pytest.mark.parametrize(
    "write",
    [
        in_mesh,
        with_basis,
        in_primitive,
        in_primitive_rather_than_in_a_mesh_of_other_names,
        under_another_key,
        under_a_key_of_two_words,
        in_each_target,
        in_accessors,
        in_extras_of_accessors,
    ],
)
def test_names_are_found(tmp_path: Path, write: Callable[[Any], None], caplog) -> None:
    builder = nameless(Builder(), "head")
    builder.animate([0.0, 0.5], np.ones((2, 2)))
    write(builder.document)
    path = builder.save(tmp_path / "face.glb")
    assert read_gltf_rig(path).names == read_gltf_take(path).source.names == tuple(NAMES)
    assert not caplog.records


@pytest.mark.parametrize(
    "names", [["accessor_7", "accessor_8"], ["Position", "Position"], ["", ""]]
)
def test_accessors_that_are_but_numbered_name_nothing(tmp_path: Path, names: list[str]) -> None:
    builder = nameless(Builder(), "head")
    for target, name in zip(builder.document.meshes[0].primitives[0].targets, names, strict=True):
        builder.document.accessors[target["POSITION"]].name = name
    assert read_gltf_rig(builder.save(tmp_path / "a.glb")).names == ("target1", "target2")


@pytest.mark.parametrize(
    ("meshes", "prefixes"),
    [
        (("head", "teeth"), ("head", "teeth")),
        ((None, None), ("mesh1", "mesh2")),
        (("head", "head"), ("mesh1", "mesh2")),
    ],
)
def test_targets_without_names_of_two_meshes_are_four(tmp_path, caplog, meshes, prefixes) -> None:
    builder = nameless(Builder(), *meshes)
    builder.animate([0.0, 0.5], np.full((2, 2), 0.5), node=1)
    path = builder.save(tmp_path / "face.glb")
    rig = read_gltf_rig(path)
    first, second = prefixes
    wanted = tuple(f"{mesh}_target{number}" for mesh in prefixes for number in (1, 2))
    assert rig.names == wanted
    assert f"{first}, {second}: morph targets without a name are called" in caplog.text
    np.testing.assert_allclose(rig.shapes[2], [[0, 0, 0]] * 3 + [[0, 2, 0]] * 3)
    assert read_gltf_take(path).source.names == wanted[2:]


def test_a_mesh_without_names_beside_one_with_names_is_numbered(tmp_path: Path) -> None:
    builder = nameless(Builder(), "head", "teeth")
    builder.document.meshes[0].extras = {"targetNames": NAMES}
    path = builder.save(tmp_path / "face.glb")
    assert read_gltf_rig(path).names == (*NAMES, "target1", "target2")


def test_an_empty_name_becomes_a_number_and_a_number_a_name(tmp_path: Path) -> None:
    builder = nameless(Builder(), "head")
    builder.document.meshes[0].extras = {"targetNames": [None, 7]}
    assert read_gltf_rig(builder.save(tmp_path / "a.glb")).names == ("target1", "7")


def test_numbers_for_empty_names_never_merge_targets(tmp_path: Path) -> None:
    builder = nameless(Builder(), "head")
    builder.document.meshes[0].extras = {"targetNames": ["target2", ""]}
    rig = read_gltf_rig(builder.save(tmp_path / "a.glb"))
    assert rig.names == ("target2", "nameless_target2")
    builder = nameless(Builder(), "head", "teeth")
    for mesh in builder.document.meshes:
        mesh.extras = {"targetNames": ["jawOpen", ""]}
    rig = read_gltf_rig(builder.save(tmp_path / "b.glb"))
    assert rig.names == ("jawOpen", "head_target2", "teeth_target2")


@pytest.mark.parametrize("stale", [["a"], ["a", "a"], ["a", "b", "c"]])
def test_names_of_accessors_count_where_a_list_is_stale(tmp_path: Path, stale: list[str]) -> None:
    builder = nameless(Builder(), "head")
    in_accessors(builder.document)
    builder.document.meshes[0].extras = {"targetNames": stale}
    assert read_gltf_rig(builder.save(tmp_path / "a.glb")).names == tuple(NAMES)


def test_a_list_of_no_names_is_as_none(tmp_path: Path) -> None:
    builder = nameless(Builder(), "head")
    builder.document.meshes[0].extras = {"targetNames": []}
    assert read_gltf_rig(builder.save(tmp_path / "a.glb")).names == ("target1", "target2")


@pytest.mark.parametrize("names", [["jawOpen"], ["a", "b", "c"], ["a", "a"]])
def test_names_that_cannot_be_of_these_targets_are_one_clear_error(tmp_path, names) -> None:
    builder = nameless(Builder(), "head")
    builder.document.meshes[0].extras = {"targetNames": names}
    path = builder.save(tmp_path / "a.glb")
    with pytest.raises(InputError, match="targetNames of head: expected 2 different names, found"):
        read_gltf_rig(path)


@pytest.mark.parametrize("extras", [[1], "text", 7, {"targetNames": "jawOpen"}])
def test_extras_of_any_kind_are_no_harm(tmp_path: Path, extras: Any) -> None:
    builder = nameless(Builder(), "head")
    builder.document.meshes[0].extras = extras
    assert read_gltf_rig(builder.save(tmp_path / "a.glb")).names == ("target1", "target2")


def test_one_mesh_that_two_nodes_show_has_its_names_once(tmp_path: Path) -> None:
    builder = nameless(Builder(), "eye")
    builder.document.nodes.append(type(builder.document.nodes[0])(mesh=0, translation=[5, 0, 0]))
    builder.document.scenes[0].nodes.append(1)
    rig = read_gltf_rig(builder.save(tmp_path / "a.glb"))
    assert rig.names == ("target1", "target2")
    np.testing.assert_array_equal(rig.shapes[0], [[0, 1, 0]] * 6)
    assert len(read_gltf_mesh(tmp_path / "a.glb").vertices) == 6
