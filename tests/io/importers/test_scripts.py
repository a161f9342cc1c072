"""The scripts for other programs read what facert writes, without facert."""

from __future__ import annotations

import ast
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facert.data.names import ARKIT_SHAPES
from facert.data.take import Source, Take
from facert.io.curves import write_curves
from facert.io.formats import write_take_file
from facert.io.importers import PROGRAMS, script
from facert.io.importers.shared import find, keys, read_curves, spelling

VALUES = np.array([[0.1, 0.5], [np.nan, 0.5], [0.3, 0.5]])
TAKE = Take([0.5, 0.54, 0.58], Source(VALUES, ("jawOpen", "eyeBlink_L")), fps=25.0)


@pytest.mark.parametrize("ending", ["json", "csv"])
def test_curves_are_read_as_they_were_written(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"curves.{ending}"
    write_take_file(TAKE, path)
    curves = read_curves(str(path))
    assert curves.values == {"jawOpen": [0.1, None, 0.3], "eyeBlink_L": [0.5, 0.5, 0.5]}
    assert curves.fps == pytest.approx(25.0)
    np.testing.assert_allclose(curves.time, TAKE.time)


def test_a_table_that_states_its_columns_is_read_as_well(tmp_path: Path) -> None:
    path = tmp_path / "curves.csv"
    write_take_file(Take([0.0, 0.1], Source([[1.0, 2.0], [3.0, 4.0]], ("frame", "time"))), path)
    assert path.read_text().startswith('"time (weights)",frame,time\n')
    curves = read_curves(str(path))
    assert curves.values == {"frame": [1.0, 3.0], "time": [2.0, 4.0]}
    assert curves.time == [0.0, 0.1]


def test_what_is_not_known_gets_no_key_and_a_constant_curve_one(tmp_path: Path) -> None:
    write_curves(TAKE, tmp_path / "curves.json")
    curves = read_curves(str(tmp_path / "curves.json"))
    assert keys(curves, "jawOpen") == [(0.5, 0.1), (0.58, 0.3)]
    assert keys(curves, "eyeBlink_L") == [(0.5, 0.5)]


@pytest.mark.parametrize("name", ["eyeBlinkLeft", "EyeBlink_L", "eye_blink.l", "eyeBlinkL"])
def test_spellings_of_a_name_are_one(name: str) -> None:
    assert spelling(name) == "eyeblinkleft"
    assert find(name, ["jawOpen", "EyeBlinkLeft", "eyeBlinkRight"]) == "EyeBlinkLeft"


def test_names_that_are_different_stay_so() -> None:
    assert len({spelling(name) for name in ARKIT_SHAPES}) == len(ARKIT_SHAPES)
    assert find("brow", ["browUp"]) is None
    assert find("a_b", ["ab", "a-b"]) is None  # either could be meant


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_script_needs_no_facert(program: str) -> None:
    text = script(program)
    compile(text, program, "exec")
    assert "import facert" not in text
    assert "from facert" not in text
    assert text.startswith('"""Keys the ')


@pytest.mark.parametrize(("program", "addon"), [*((p, False) for p in PROGRAMS), ("blender", True)])
def test_no_name_of_a_script_is_given_twice(program: str, addon: bool) -> None:
    defined = [
        name
        for node in ast.parse(script(program, addon)).body
        for name in (
            [node.name]
            if isinstance(node, ast.FunctionDef | ast.ClassDef)
            else [one.id for one in getattr(node, "targets", []) if isinstance(one, ast.Name)]
        )
    ]
    assert sorted(defined) == sorted(set(defined))


# What the script asks of Maya, in Python alone: it keeps what is keyed.
MAYA = """
import sys, types
class cmds:
    keyed = []
    objExists = staticmethod(lambda node: node == "face")
    listAttr = staticmethod(lambda node, keyable, multi: ["JawOpen", "eyeBlinkLeft", "smile"])
    warning = staticmethod(print)
    @classmethod
    def setKeyframe(cls, node, **key):
        cls.keyed.append((node, key["attribute"], key["time"], key["value"]))
maya = types.ModuleType("maya"); maya.cmds = cmds
sys.modules.update({"maya": maya, "maya.cmds": cmds})
"""


def run(folder: Path, *parts: str) -> str:
    """What a Python that knows nothing of facert prints."""
    (folder / "script.py").write_text("\n".join(parts))
    command = [sys.executable, "-I", "-S", "script.py"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout


@pytest.fixture(name="folder")
def _folder(tmp_path: Path) -> Path:
    named = Source(np.c_[VALUES, [2.0, 0, -1]], ("jawOpen", "eyeBlink_L", "other.smile"))
    write_curves(replace(TAKE, source=named), tmp_path / "curves.json")
    return tmp_path


def without_future(program: str) -> str:
    return script(program).replace("from __future__ import annotations", "")


def test_maya_keys_attributes_by_time(folder: Path) -> None:
    call = 'key_attributes("curves.json", "face"); print(cmds.keyed)'
    printed = run(folder, "from __future__ import annotations", MAYA, without_future("maya"), call)
    keyed: list[Any] = eval(printed.splitlines()[-1])
    assert keyed == [
        ("face", "JawOpen", "0.000000sec", 0.1),
        ("face", "JawOpen", "0.080000sec", 0.3),
        ("face", "eyeBlinkLeft", "0.000000sec", 0.5),
    ]
    assert "no attribute for 'other.smile'" in printed
