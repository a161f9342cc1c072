"""Every command and every line of Python in the README works as printed."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
(POSES,) = [block for language, block in BLOCKS if language == "csv"]
PYTHON = [block for language, block in BLOCKS if language == "python"]
COMMANDS = [
    shlex.split(line)[1:]
    for language, block in BLOCKS
    for line in block.splitlines()
    if not language and line.startswith("facert ")
]


@pytest.mark.slow
def test_quick_start_and_python_run_as_printed(facert, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_take, use_from_python = PYTHON[0], PYTHON[-1]

    exec(write_take, {})
    Path("poses.csv").write_text(POSES)
    rows = [f"{frame / 30},{frame / 100},{frame % 7}" for frame in range(100)]
    Path("recording.csv").write_text("\n".join(["time,eyeBlinkLeft,jawOpen", *rows]))
    for command in COMMANDS:
        outcome = facert(*command)
        assert outcome.code == 0, outcome.err
    exec(use_from_python, {})

    assert len(COMMANDS) == 9
    assert (tmp_path / "curves.png").exists()
    assert (tmp_path / "python.h5").exists()


def test_every_command_is_in_the_table(facert):
    listed = set(re.findall(r"^\| `facert ([\w-]+)", README, re.MULTILINE))
    offered = set(re.findall(r"^│ ([a-z][\w-]*) ", facert("--help").out, re.MULTILINE))

    assert listed == offered


def test_every_method_is_in_the_table():
    from facert.methods.registry import REGISTRY

    table = README.split("| method | what it learns")[1].split("\n\n")[0]
    assert re.findall(r"^\| `([\w-]+)` \|", table, re.MULTILINE) == list(REGISTRY)
