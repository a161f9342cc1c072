"""glTF files that are damaged, or made to do harm, are one error and no more."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from gltf_files import glb
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.errors import InputError
from facert.io.gltf.container import MAX_VALUES, MOST
from facert.io.gltf.document import open_gltf
from facert.io.gltf.rig import read_gltf_rig
from facert.io.gltf.take import read_gltf_take

BLENDER = Path(__file__).parent / "files" / "blender.glb"  # made and exported in Blender 5.0


def rewritten(path: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    """The file of Blender with its JSON changed."""
    with open_gltf(BLENDER) as document:
        root = json.loads(json.dumps(document.root))
        change(root)
        path.write_bytes(glb(root, document.buffers[0]))


def at(*keys: Any) -> Callable[[Any], Callable[[dict[str, Any]], None]]:
    """Sets what stands at a place of the JSON."""

    def to(value: Any) -> Callable[[dict[str, Any]], None]:
        def change(root: Any) -> None:
            for key in keys[:-1]:
                root = root[key]
            root[keys[-1]] = value

        return change

    return to


HOSTILE = {
    "a count beyond the bytes": at("accessors", 0, "count")(10**6),
    "a count beyond all memory": at("accessors", 0, "count")(10**15),
    "a count beyond all memory and no bytes": at("accessors", 0)(
        {"componentType": 5126, "count": 10**12, "type": "VEC3"}
    ),
    "a negative offset": at("bufferViews", 0, "byteOffset")(-84),
    "an offset beyond the bytes": at("bufferViews", 0, "byteOffset")(10**9),
    "a stride beyond the bytes": at("bufferViews", 0, "byteStride")(10**9),
    "an offset that is text": at("bufferViews", 0, "byteOffset")("x"),
    "a view that is not there": at("accessors", 0, "bufferView")(99),
    "an accessor that is not there": at("meshes", 0, "primitives", 0, "attributes", "POSITION")(99),
    "an unknown type": at("accessors", 0, "componentType")(1),
    "indices beyond the vertices": at("meshes", 0, "primitives", 0, "indices")(8),
    "a mesh of text": at("meshes")("none"),
    "nodes that are no list": at("nodes")(7),
    "a node that is not there": at("scenes", 0, "nodes")([5]),
    "a rotation of nothing": at("nodes", 0, "rotation")([0, 0, 0, 0]),
    "a matrix that is too small": at("nodes", 0, "matrix")([1, 2]),
    "fewer names than targets": at("meshes", 0, "extras", "targetNames")(["smile"]),
    "one name for two targets": at("meshes", 0, "extras", "targetNames")(["a", "a"]),
    "a name that upsets a terminal": at("meshes", 0, "extras", "targetNames")(["\x1b[2J", "b"]),
    "a file elsewhere": at("buffers", 0, "uri")("../../etc/passwd"),
    "a file elsewhere in other signs": at("buffers", 0, "uri")("%2e%2e%2fpasswd"),
    "the folder above": at("buffers", 0, "uri")(".."),
    "an address": at("buffers", 0, "uri")("file:///etc/passwd"),
    "no base64": at("buffers", 0, "uri")("data:a;base64,%%%"),
    "another version": at("asset", "version")("1.0"),
    "compression": at("extensionsRequired")(["KHR_draco_mesh_compression"]),
}


MANY = {
    "values": at("extras")([0] * (MAX_VALUES + 1)),
    "nodes": at("nodes")([{"mesh": 0}] + [{}] * MOST["nodes"]),
    "children": at("nodes", 0, "children")([0] * (MOST["children"] + 1)),
    "meshes": at("nodes")([{"mesh": 0}] * (MOST["meshes"] + 1)),
    "channels": at("animations")([{"channels": [0] * (MOST["channels"] + 1), "samplers": []}]),
}


@pytest.mark.parametrize("what", MANY)
def test_more_than_a_character_has_is_refused_before_it_is_walked(
    tmp_path: Path, what: str
) -> None:
    path = tmp_path / "face.glb"
    rewritten(path, MANY[what])
    for read in (read_gltf_rig, read_gltf_take):
        with pytest.raises(InputError, match=f"{what}.*: expected at most"):
            read(path)


@pytest.mark.parametrize("what", HOSTILE)
def test_a_hostile_rig_is_one_error(tmp_path: Path, what: str) -> None:
    path = tmp_path / "face.glb"
    rewritten(path, HOSTILE[what])
    with pytest.raises(InputError) as caught:
        read_gltf_rig(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    "change",
    [
        at("animations", 0, "channels", 0, "sampler")(4),
        at("animations", 0, "channels", 0, "target", "node")(4),
        at("animations", 0, "samplers", 0, "input")(8),
        at("animations", 0, "samplers", 0, "output")(7),
        at("animations", 0, "samplers", 0, "interpolation")("CUBICSPLINE"),
        at("animations")("none"),
    ],
)
def test_a_hostile_animation_is_one_error(tmp_path: Path, change: Any) -> None:
    path = tmp_path / "face.glb"
    rewritten(path, change)
    with pytest.raises(InputError) as caught:
        read_gltf_take(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_indentation_by_tabs_is_no_value(tmp_path: Path) -> None:
    with open_gltf(BLENDER) as document:
        root = json.loads(json.dumps(document.root))
        data = base64.b64encode(document.buffers[0]).decode()
    root["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{data}"
    root["extras"] = [[[0] * 1000] * (MAX_VALUES // 2000)]
    (tmp_path / "face.gltf").write_text(json.dumps(root, indent="\t"))
    assert read_gltf_rig(tmp_path / "face.gltf").names == ("smile", "blink")


def test_nodes_that_are_each_others_children_end(tmp_path: Path) -> None:
    rewritten(tmp_path / "a.glb", at("nodes", 0, "children")([0]))
    assert read_gltf_rig(tmp_path / "a.glb").names == ("smile", "blink")


@pytest.mark.parametrize("size", [0, 3, 11, 19, 40, 2000])
def test_a_file_that_is_cut_short_is_refused(tmp_path: Path, size: int) -> None:
    path = tmp_path / "face.glb"
    path.write_bytes(BLENDER.read_bytes()[:size])
    with pytest.raises(InputError):
        read_gltf_rig(path)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2527), st.integers(0, 255)), min_size=1, max_size=4))
def test_damaged_bytes_give_a_face_or_one_error(tmp_path_factory, changes) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.glb"
    content = bytearray(BLENDER.read_bytes())
    for place, value in changes:
        content[place] = value
    path.write_bytes(content)
    for read in (read_gltf_rig, read_gltf_take):
        with suppress(InputError):
            assert read(path) is not None
