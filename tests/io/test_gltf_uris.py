"""A glTF document names bytes in itself or in files of its own folder, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from gltf_files import FACE

from facert.errors import InputError
from facert.io.formats import read_any


def document(uri: Any) -> str:
    """A face whose bytes are elsewhere."""
    size = FACE.nbytes
    primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}
    root = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": uri, "byteLength": size}],
        "bufferViews": [{"buffer": 0, "byteLength": size}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["smile"]}}],
        "nodes": [{"mesh": 0}],
    }
    return json.dumps(root)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder for the document, beside a file that is none of its business."""
    (tmp_path / "secret.bin").write_bytes(FACE.tobytes())
    (tmp_path / "own").mkdir()
    return tmp_path / "own"


@pytest.mark.parametrize("name", ["face.bin", "parts/my face.bin", "a%b.bin", "ä.bin"])
def test_files_in_the_folder_and_below_are_read(folder: Path, name: str) -> None:
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_bytes(FACE.tobytes())
    (folder / "face.gltf").write_text(document(quote(name)))
    assert read_any(folder / "face.gltf").names == ("smile",)  # type: ignore[union-attr]


def outside(folder: Path) -> dict[str, Any]:
    secret = folder.parent / "secret.bin"
    return {
        "above": "../secret.bin",
        "above, from below": "parts/../../secret.bin",
        "up and down": "parts/../face.bin",
        "percent": "%2e%2e/secret.bin",
        "percent, all of it": "%2e%2e%2fsecret.bin",
        "absolute": str(secret),
        "absolute by percent": quote(str(secret), safe=""),
        "an address": f"file://{secret}",
        "a short address": "file:secret.bin",
        "an address of the network": "https://localhost/secret.bin",
        "another host": "//localhost/secret.bin",
        "a drive": "C:secret.bin",
        "a backslash": "..\\secret.bin",
        "a share": "\\\\host\\secret.bin",
        "an end within": "face.bin\0.txt",
        "the folder": ".",
        "nothing": "",
        "a number": 7,
        "none": None,
    }


@pytest.mark.parametrize("what", outside(Path("/a/b")))
def test_anything_else_is_refused(folder: Path, what: str) -> None:
    (folder / "parts").mkdir()
    (folder / "face.bin").write_bytes(FACE.tobytes())
    (folder / "face.gltf").write_text(document(outside(folder)[what]))
    with pytest.raises(InputError, match="data in the file or beside it"):
        read_any(folder / "face.gltf")


def test_a_link_that_leads_out_is_refused(folder: Path) -> None:
    (folder / "face.bin").symlink_to(folder.parent / "secret.bin")
    (folder / "face.gltf").write_text(document("face.bin"))
    with pytest.raises(InputError, match="which leads to"):
        read_any(folder / "face.gltf")


def test_a_linked_folder_that_leads_out_is_refused(folder: Path) -> None:
    (folder / "parts").symlink_to(folder.parent)
    (folder / "face.gltf").write_text(document("parts/secret.bin"))
    with pytest.raises(InputError, match="which leads to"):
        read_any(folder / "face.gltf")


def test_links_in_a_circle_are_refused(folder: Path) -> None:
    (folder / "face.bin").symlink_to(folder / "face.bin")
    (folder / "face.gltf").write_text(document("face.bin"))
    with pytest.raises(InputError):
        read_any(folder / "face.gltf")


def test_a_document_behind_a_link_has_the_folder_that_it_lies_in(folder: Path) -> None:
    (folder / "face.bin").write_bytes(FACE.tobytes())
    (folder / "face.gltf").write_text(document("face.bin"))
    (folder.parent / "face.bin").write_bytes(b"of another")
    (folder.parent / "linked.gltf").symlink_to(folder / "face.gltf")
    assert read_any(folder.parent / "linked.gltf").names == ("smile",)  # type: ignore[union-attr]
