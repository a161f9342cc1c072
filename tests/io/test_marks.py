"""Files that facert did not write are never replaced; every format knows facert's own."""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from safetensors.numpy import save

import facert
from facert.data.names import ARKIT_NAMES
from facert.data.rig import MeshSequence, Rig
from facert.data.take import Source, Take
from facert.errors import OutputExistsError, OutputKeptError
from facert.io.atomic import replacing
from facert.io.formats import write_rig_file, write_take_file
from facert.io.gltf.writer import write_glb
from facert.io.mesh_sequence import write_mesh_sequence
from facert.io.registry import FORMATS, is_foreign, require_replaceable
from facert.io.take import holds_recording, holds_result
from facert.io.tensors import write_tensors
from facert.mesh.morphs import Morphs
from facert.retarget.checkpoint import CheckpointMetadata, CurveLog

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
RIG = Rig(TRIANGLE, np.ones((1, 3, 3)), ("jawOpen",), np.array([[0, 1, 2]]), "cm")
MORPHS = Morphs(RIG.mesh, RIG.shapes, RIG.names, np.array([[0.0], [1.0]]), np.array([0.0, 0.1]))


def weights(names: tuple[str, ...] = ("jawOpen", "mouthClose")) -> Take:
    values = np.linspace(0.0, 1.0, 3 * len(names)).reshape(3, -1)
    return Take(np.arange(3) / 30.0, Source(values, names), fps=30.0)


def write_usd(path: Path, overwrite: bool = False) -> None:
    pytest.importorskip("pxr")
    from facert.io.usd import write_usd as write

    write(MORPHS, path, overwrite)


OWN: dict[str, Callable[[Path, bool], None]] = {
    "take.h5": lambda path, over: write_take_file(weights(), path, over),
    "rig.hdf5": lambda path, over: write_rig_file(RIG, path, over),
    "face.h5": lambda path, over: write_mesh_sequence(
        MeshSequence(
            RIG.mesh, np.arange(2) / 30.0, lambda rows: np.stack([TRIANGLE] * len(rows)), 30.0
        ),
        path,
        over,
    ),
    "face.livelink.csv": lambda path, over: write_take_file(weights(ARKIT_NAMES), path, over),
    "table.csv": lambda path, over: write_take_file(weights(), path, over),
    "names.csv": lambda path, over: write_take_file(weights(("a,b", "frame", '"c"')), path, over),
    "log.txt": lambda path, over: CurveLog(path, over).resume(""),
    "face.curvetable.csv": lambda path, over: write_take_file(weights(), path, over),
    "face.curvetable.json": lambda path, over: write_take_file(weights(), path, over),
    "curves.json": lambda path, over: write_take_file(weights(), path, over),
    "face.glb": lambda path, over: write_glb(MORPHS, path, over),
    "face.usda": write_usd,
    "face.usdc": write_usd,
    "face.usd": write_usd,
    "model.safetensors": lambda path, over: write_tensors(
        path, {"x": np.ones(2)}, CheckpointMetadata(""), "facert-checkpoint", over
    ),
}


def glb(document: dict[str, object]) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<IIIII", 0x46546C67, 2, 20 + len(text), len(text), 0x4E4F534A) + text


def hdf5(path: Path, **attributes: str) -> bytes:
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(3.0)
        file.attrs.update(attributes)
    return path.read_bytes()


FOREIGN = {
    "phone.livelink.csv": b"Timecode,BlendShapeCount,A\n10:00:00:00.000,61,0.1234567890\n",
    "pandas.csv": b"time,jawOpen\n0,0.5\n",
    "all-quoted.csv": b'"time","jawOpen"\r\n0,0.5\r\n',
    "numbers.csv": b'"time",0,1\n0,0.5,0.5\n',
    "text-quoted.csv": b'"time","a,b","c"\n0,0.5,0.5\n',
    "one-more-quoted.csv": b'"time",jaw,"smile"\n0,0.5,0.5\n',
    "bom.csv": b'\xef\xbb\xbf"time",jaw\n0,0.5\n',
    "excel.csv": b"time;jawOpen\n0;0,5\n",
    "alone.csv": b'"time"\n0\n',
    "phone.txt": b"info,Face Cap\nbs,eyeBlink_L\nk,0,0\n",
    "unreal.curvetable.csv": b"---,0.000000,0.033333\nJawOpen,0.1,0.2\n",
    "unreal.curvetable.json": b'[\n\t{\n\t\t"Name": "JawOpen",\n\t\t"0": 0.1\n\t}\n]',
    "a2f.json": b'{"exportFps": 30, "facsNames": ["jawOpen"], "weightMat": [[0.5]]}',
    "list.json": b"[1, 2, 3]",
    "later.json": b'{"fps": 30, "created_by": "facert 0.1.0"}',
    "other.json": b'{"createdBy": "facertain 2"}',
    "blender.glb": glb({"asset": {"generator": "Khronos glTF Blender I/O v4", "version": "2.0"}}),
    "named.glb": glb({"asset": {"version": "2.0"}, "nodes": [{"name": "facert 0.1.0"}]}),
    "text.gltf": b'{"asset": {"version": "2.0", "generator": "facer"}}',
    "maya.usda": b'#usda 1.0\n(\n    "Exported by Maya"\n)\ndef Xform "facert 1"\n{\n}\n',
    "maya.usdc": b"PXR-USDC\0\x08" + bytes(80) + b"facert",
    "other.safetensors": save({"x": np.ones(3)}, {"made_by": "facert"}),
    "vicon.c3d": b"\x02\x50" + bytes(510),
    "track.trc": b"PathFileType\t4\n",
    "track.npz": b"PK\x03\x04",
    "neutral.obj": b"v 0 0 0\n",
    "face.ply": b"ply\n",
}


@pytest.mark.parametrize("name", OWN)
def test_what_facert_wrote_is_replaced_with_overwrite_alone(tmp_path: Path, name: str) -> None:
    path, write = tmp_path / name, OWN[name]
    write(path, False)
    assert not is_foreign(path)
    with pytest.raises(OutputExistsError, match="--overwrite"):
        write(path, False)
    write(path, True)


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("name", FOREIGN)
def test_what_it_did_not_write_never_is(tmp_path: Path, name: str, overwrite: bool) -> None:
    path = tmp_path / name.upper()
    path.write_bytes(FOREIGN[name])
    with pytest.raises(OutputKeptError) as refused, replacing(path, overwrite) as temporary:
        temporary.write_text("new")
    text = str(refused.value)
    assert text.startswith(f"{path}: the file was not written by facert: it is never replaced.")
    assert "--overwrite" not in text
    assert refused.value.exit_code == 3
    assert path.read_bytes() == FOREIGN[name]


@pytest.mark.parametrize(
    "attributes",
    [
        {},
        {"created_by": "facertain"},
        {"format": "facert-take"},
        {"format": "facert-take", "created_by": "mine"},
    ],
)
def test_a_take_that_another_program_wrote_is_kept(tmp_path: Path, attributes) -> None:
    path = tmp_path / "take.h5"
    content = hdf5(path, **attributes)
    for write in (OWN["take.h5"], OWN["rig.hdf5"], OWN["face.h5"]):
        with pytest.raises(OutputKeptError):
            write(path, True)
    assert path.read_bytes() == content


def test_the_api_keeps_them_too(tmp_path: Path) -> None:
    for name in ("a.h5", "a.json", "a.livelink.csv"):
        path = tmp_path / name
        path.write_bytes(b"somebody's")
        with pytest.raises(OutputKeptError):
            facert.write_take(weights(ARKIT_NAMES), path, overwrite=True)
        assert path.read_bytes() == b"somebody's"


def test_a_file_that_is_damaged_or_hostile_is_kept(tmp_path: Path) -> None:
    OWN["take.h5"](whole := tmp_path / "whole.h5", False)
    for one in FORMATS:
        for ending in one.endings:
            path = tmp_path / f"x{ending}"
            for content in (
                b"\0",
                b"\x89HDF\r\n\x1a\n",
                whole.read_bytes()[:700],
                b"{" * 5000,
                b'"' * 5000,
            ):
                if ending != "/":
                    path.write_bytes(content)
                    assert is_foreign(path)


def test_an_attribute_that_is_no_text_is_no_mark(tmp_path: Path) -> None:
    path = tmp_path / "take.h5"
    with h5py.File(path, "w") as file:
        file.attrs["created_by"] = np.arange(4)
    assert is_foreign(path)


def test_an_empty_file_is_nobodys(tmp_path: Path) -> None:
    for name in ("a.h5", "a.csv", "a.glb"):
        path = tmp_path / name
        path.touch()
        require_replaceable(path, overwrite=True)
        with pytest.raises(OutputExistsError, match="--overwrite"):
            require_replaceable(path, overwrite=False)


def test_endings_that_facert_does_not_know_are_replaced(tmp_path: Path) -> None:
    path = tmp_path / "picture.bmp"
    path.write_bytes(b"anything")
    with replacing(path, overwrite=True) as temporary:
        temporary.write_bytes(b"new")
    assert path.read_bytes() == b"new"


def test_a_link_to_a_recording_stays(tmp_path: Path) -> None:
    recording, link = tmp_path / "take.json", tmp_path / "link.json"
    recording.write_bytes(FOREIGN["a2f.json"])
    link.symlink_to(recording)
    with pytest.raises(OutputKeptError):
        facert.write_take(weights(), link, overwrite=True)
    assert link.is_symlink()
    assert recording.read_bytes() == FOREIGN["a2f.json"]


def test_a_large_file_is_not_read(tmp_path: Path) -> None:
    for name in ("a.glb", "a.json", "a.usd", "a.safetensors", "a.livelink.csv", "a.npz"):
        path = tmp_path / name
        with path.open("wb") as file:
            file.truncate(2**34)
        began = time.perf_counter()
        assert is_foreign(path)
        assert time.perf_counter() - began < 0.1


def test_results_and_recordings_are_known_from_their_poses(tmp_path: Path, make_take) -> None:
    from dataclasses import replace

    posed = make_take(frames=20, posed=20, animation=0)
    takes = {
        "recording": make_take(frames=20, posed=0, animation=0),
        "labelled": make_take(frames=20, posed=3),
        "posed": posed,
        "result": replace(posed, std=np.full((20, 4), 0.1)),
    }
    found = {}
    for name, take in takes.items():
        path = tmp_path / f"{name}.h5"
        facert.write_take(take, path)
        found[name] = holds_recording(path), holds_result(path)
    write_rig_file(RIG, tmp_path / "rig.h5")
    assert found == {
        "recording": (True, False),
        "labelled": (True, False),
        "posed": (False, False),
        "result": (False, True),
    }
    for other in ("rig.h5", "none.h5"):
        assert not holds_recording(tmp_path / other)
        assert not holds_result(tmp_path / other)
