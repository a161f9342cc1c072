import logging
import os
import shutil
from pathlib import Path

import pytest

from facert.io.folder import takes_in
from facert.io.obj import read_obj_folder

DATA = Path(__file__).parents[2] / "data"

ODD = {
    "empty.csv": b"",
    "byte.csv": b"\x00",
    "binary.csv": bytes(range(256)) * 9,
    "line.csv": b"\n\n\n",
    "mark.csv": b"\xff\xfe",
    "empty.json": b"",
    "empty.h5": b"",
    "empty.npz": b"",
    "zip.npz": b"PK\x03\x04",
    "short.glb": b"glTF\x02",
    "empty.glb": b"",
    "none.gltf": b"[]",
    "roots.gltf": b'{"animations": 5, "asset": []}',
}


@pytest.mark.parametrize("name", ODD)
def test_whatever_a_file_holds_no_look_at_it_ends_a_batch(name, tmp_path):
    (tmp_path / name).write_bytes(ODD[name])
    assert {path.name for path in takes_in(tmp_path)} <= {name}
    if not ODD[name]:  # reading it says so
        assert takes_in(tmp_path)


def test_what_is_no_file_is_none_to_read(tmp_path):
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "gone.csv").symlink_to(tmp_path / "nowhere")
    os.mkfifo(tmp_path / "pipe.csv")
    assert takes_in(tmp_path) == []


@pytest.mark.parametrize(
    "name",
    [
        ".a-1a2b.h5", "._a.h5", ".DS_Store", ".facert-0123456789-77-01234567.h5", "~$a.csv",
        "~a.csv", "a.csv~", "#a.csv#", ".~lock.a.csv#", "a.h5.part", "a.h5.crdownload", "a.h5.tmp",
        "a.csv.bak", "a.h5.recording",
    ],
)  # fmt: skip
def test_leftovers_and_files_of_the_system_are_no_takes(name, tmp_path):
    take, rig = DATA / "performance.h5", tmp_path / "rig"
    shutil.copy(take, tmp_path / name)
    assert takes_in(tmp_path) == []
    rig.mkdir()
    for mesh in ("neutral.obj", "smile.obj"):
        (rig / mesh).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (rig / f"._{name}.obj").write_bytes(b"\0\5\x16\7")
    assert read_obj_folder(rig).names == ("smile",)


def test_an_unexpected_error_leaves_it_to_reading(tmp_path, monkeypatch):
    (tmp_path / "take.csv").write_text("time,jawOpen\n0,0\n")

    def denied(path):
        raise ValueError(path)

    monkeypatch.setattr("facert.io.folder.encoding_of", denied)
    assert [path.name for path in takes_in(tmp_path)] == ["take.csv"]


@pytest.mark.parametrize(
    ("text", "is_take"),
    [
        ("shot,note\n010,good\n020,the eyes\n", False),
        ("shot;frames in all;note\n010;812;good\n020;400;again\n", False),
        ("shot,date,by\na,Monday,Jo\nb,Tuesday,Al\n", False),
        ("time,jawOpen,state\n0.0,0.1,tracked\n0.1,0.2,tracked\n", True),
        ("timecode,jawOpen,name\n01:00:00:01,0.1,Jo\n01:00:00:02,0.2,Jo\n", True),
        ("jawOpen,mouthClose\n0.1,0.2\n0.2,1e-3\n", True),  # reading asks for its times
        ("time,jawOpen\n", True),
        ("time,jawOpen\n0.0,nan\n0.1,nan\n", True),
    ],
)
def test_a_list_of_shots_is_no_take(text, is_take, tmp_path):
    (tmp_path / "table.csv").write_text(text)
    assert bool(takes_in(tmp_path)) is is_take


def test_all_that_is_passed_over_is_named(tmp_path, caplog):
    names = [f"note{number}.md" for number in range(9)]
    for name in names:
        (tmp_path / name).write_text("")
    with caplog.at_level(logging.INFO, "facert"):
        takes_in(tmp_path)
    (line,) = caplog.messages
    assert all(name in line for name in names)
