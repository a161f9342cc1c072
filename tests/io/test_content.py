"""Files under another ending are read as what they are, or the error says what they look like."""

from __future__ import annotations

import json
import os
from base64 import b64encode
from pathlib import Path
from threading import Thread

import ezc3d
import numpy as np
import pytest
from gltf_files import Builder

from facert.data.rig import Rig
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.io.content import endings_by_content
from facert.io.formats import read_any, read_mesh, read_rig_file, read_take_file
from facert.io.guarded import existing_file
from facert.io.hdf5 import stated_format
from facert.io.rig import write_rig
from facert.io.take import write_take

TRC = "PathFileType\t4\nDataRate\n60\nFrame#\tTime\tchin\nX1\n1\t0\t1\t2\t3\n2\t0.0167\t1\t2\t4\n"
RIG = Rig(np.eye(3), np.ones((1, 3, 3)), ("jawOpen",), np.array([[0, 1, 2]]))


def glb(path: Path) -> Path:
    builder = Builder()
    builder.mesh(np.eye(3, dtype=np.float32), {"jawOpen": np.ones((3, 3), np.float32)})
    builder.animate([0.0, 0.5], np.ones((2, 1)))
    return builder.save(path.with_name("x.glb")).rename(path)


@pytest.mark.parametrize("name", ["face.bin", "face", "face.glb.txt", "face.json", "face.GLB"])
def test_a_glb_is_read_under_any_name(tmp_path: Path, name: str, caplog) -> None:
    path = glb(tmp_path / name)
    assert read_rig_file(path).names == read_take_file(path).source.names == ("jawOpen",)
    assert len(read_mesh(path).vertices) == 3
    assert ("read as .glb, which it is by its content" in caplog.text) == (name != "face.GLB")


@pytest.mark.parametrize("name", ["face.json", "face", "face.gltf.txt"])
def test_a_gltf_document_is_read_under_any_name(tmp_path: Path, name: str) -> None:
    corners = np.eye(3, dtype="<f4").tobytes()
    root = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}]}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "bufferView": 0}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": f"data:;base64,{b64encode(corners).decode()}"}],
    }
    (tmp_path / name).write_text(json.dumps(root))
    assert read_rig_file(tmp_path / name).names == ("target1",)


@pytest.mark.parametrize("name", ["face.txt", "face.trc.txt", "face.csv", "face"])
def test_a_trc_file_is_read_under_any_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(TRC)
    assert read_take_file(tmp_path / name).source.names == ("chin",)


def test_other_formats_are_read_under_other_names(tmp_path: Path) -> None:
    take = Take(np.arange(3) / 30, Source(np.zeros((3, 1)), ("jawOpen",)))
    write_take(take, tmp_path / "a.h5")
    write_rig(RIG, tmp_path / "b.h5")
    np.savez(tmp_path / "c.npz", weights=np.zeros((3, 1)), weight_names=["jawOpen"], fps=30)
    markers = ezc3d.c3d()
    markers["parameters"]["POINT"]["RATE"]["value"] = [60.0]
    markers["parameters"]["POINT"]["LABELS"]["value"] = ["chin"]
    markers["data"]["points"] = np.ones((4, 1, 20))
    markers.write(str(tmp_path / "d.c3d"))
    (tmp_path / "e.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n1 2 3\n1 2 4\n"
    )
    (tmp_path / "f.csv").write_text("Timecode,BlendShapeCount,JawOpen\n01:00:00:00.0,1,0.5\n")
    for file in list(tmp_path.iterdir()):
        file.rename(file.with_suffix(".download"))
    assert read_take_file(tmp_path / "a.download").source.names == ("jawOpen",)
    assert read_rig_file(tmp_path / "b.download").names == ("jawOpen",)
    assert read_take_file(tmp_path / "c.download").source.names == ("jawOpen",)
    assert read_take_file(tmp_path / "d.download").source.names == ("chin",)
    assert len(read_mesh(tmp_path / "e.download").vertices) == 2
    assert read_take_file(tmp_path / "f.download").source.names == ("jawOpen",)


@pytest.mark.parametrize("ending", [".tsv", ".tab", ".TSV"])
def test_a_table_between_tabs_is_read_under_its_own_endings(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"face{ending}"
    path.write_text("time\tjawOpen\n0\t0.5\n0.04\t0.25\n")
    assert read_take_file(path).source.names == ("jawOpen",)


@pytest.mark.parametrize(
    ("content", "advice"),
    [
        (b"Kaydara FBX Binary  \x00", "Export it as .glb from Blender"),
        (b"HIERARCHY\nROOT hips\n", "Export it as .c3d or .trc"),
        (b"#usda 1.0\n", "facert only writes USD"),
        (b"anything else", "Export it in one of these formats"),
        (b"", "Export it in one of these formats"),
    ],
)
def test_what_cannot_be_read_comes_with_advice(tmp_path: Path, content: bytes, advice: str) -> None:
    for name in ("face.download", "face"):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=advice):
            read_any(tmp_path / name)


def test_an_ending_that_fits_its_content_is_not_mentioned(tmp_path: Path, caplog) -> None:
    (tmp_path / "a.json").write_text(json.dumps({"exportFps": 30, "asset": "x"}))
    with pytest.raises(InputError, match=r"a\.json: "):
        read_any(tmp_path / "a.json")
    write_rig(RIG, tmp_path / "b.hdf5")
    read_any(tmp_path / "b.hdf5")
    assert not caplog.records


@pytest.mark.parametrize("look", [stated_format, lambda path: endings_by_content(path, True)])
def test_nothing_waits_for_a_pipe(tmp_path, look):
    path = tmp_path / "pipe.csv"
    os.mkfifo(path)
    found = []
    looking = Thread(target=lambda: found.append(look(path)), daemon=True)
    looking.start()
    looking.join(5)
    assert not any(found[0])
    with pytest.raises(InputError, match="found a pipe or a device"):
        existing_file(path)
