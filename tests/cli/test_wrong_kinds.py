"""A file of another kind than is asked for: the error says what it is, and where it goes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facert.data.rig import Rig
from facert.data.take import Source, Take
from facert.io.rig import write_rig
from facert.io.take import write_take

TABLE = "time,jawOpen\n0,0.1\n1,0.2\n"
COMMANDS = {
    "retarget {folder} out": "a folder. For all takes of a folder: --out-dir out.",
    "clean {folder} out.h5": "a folder. For all takes of a folder: --out-dir out.h5.",
    "retarget {model} {table}": "found a model. Give it with --model, and the takes in the order",
    "retarget {model} {table} out.h5": "found a model. Give it with --model",
    "render {take} out.png --rig {table}": "expected a rig, found a take. Give a rig: .h5",
    "render {take} out.png --rig {poses}": "expected a rig, found a take. Give a rig: .h5",
    "train {poses}": "facert convert RECORDING OUT.h5 --poses FILE",
    "retarget {table} out.h5 -m {take}": "found a take or a rig (.h5). Give the model itself",
    "pose --set a=1 -m {take}": "facert pose learns from a take by --poses",
    "convert {take} out.h5 --poses {rig}": "expected a take, found a rig. Give a performance, or",
    "inspect {flipped}": "line 3: expected UTF-8 text that can be read, found the byte 0xff",
    "inspect {foreign}": "file: expected UTF-8 text that can be read, found something else.",
    "retarget {table} out.h5 -m {broken}": "damaged data (bytes that are no text). Train",
}


@pytest.fixture(name="files", scope="module")
def _files(tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("kinds")
    texts = {
        "table.csv": TABLE.encode(),
        "poses.csv": b"frame,a,b\n0,0.1,0.2\n30,0.3,0.4\n",
        "flipped.csv": TABLE.encode().replace(b"0.2", b"0.\xff"),
        "foreign.csv": bytes(range(128, 256)),
        "model.safetensors": b"",
        "broken.safetensors": (16).to_bytes(8, "little") + b'{"\xff":{}}' + b" " * 16,
    }
    for name, content in texts.items():
        (folder / name).write_bytes(content)
    (folder / "folder").mkdir()
    write_rig(Rig(np.eye(3), np.ones((1, 3, 3)), ("a",), np.array([[0, 1, 2]])), folder / "rig.h5")
    write_take(Take(np.arange(2.0), Source(np.eye(2), ("a", "b"))), folder / "take.h5")
    return {path.stem: path for path in folder.iterdir()}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_error_says_what_it_is_and_where_it_goes(
    facert, files: dict[str, Path], tmp_path: Path, monkeypatch, command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    refused = facert(*command.format(**files).split())
    assert refused.code == 3
    assert COMMANDS[command] in " ".join(refused.err.split())


def test_a_model_is_named_as_it_was_given(facert, files: dict[str, Path], monkeypatch) -> None:
    monkeypatch.chdir(files["table"].parent)
    refused = facert("retarget", "table.csv", "out.h5", "-m", "broken.safetensors")
    assert "error: broken.safetensors: the header" in refused.err
