"""The scripts for other programs read what facert writes, without facert."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facert.data.labelling import labelled
from facert.data.names import ARKIT_SHAPES
from facert.data.take import Source, Take
from facert.io.curves import write_curves
from facert.io.formats import write_take_file
from facert.io.importers import PROGRAMS, script
from facert.io.importers.motions import added, controls_at, motions_of
from facert.io.importers.shared import (
    Pose,
    ScriptError,
    Timeline,
    find,
    keys,
    listed_frames,
    read_curves,
    read_suggestions,
    spelling,
    write_poses,
)
from facert.io.poses import read_poses

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
    keyed, curves = [], {}
    still = {"joint.rotateOrder": 0, "joint.rotate": [(0.0, 30.0, 0.0)],
             "joint.translate": [(1.0, 2.0, 3.0)], "joint.jointOrient": [(0.0, 0.0, 90.0)]}
    attributes = {"face": ["envelope", "JawOpen", "eyeBlinkLeft", "smile"], "joint": [],
                  "rig": ["wink", "visibility"]}
    objExists = staticmethod(lambda node: node in cmds.attributes)
    listAttr = staticmethod(lambda node, keyable, multi: cmds.attributes[node])
    nodeType = staticmethod(lambda node: {"face": "blendShape"}.get(node, "joint"))
    currentUnit = staticmethod(lambda query, **what: "cm" if "linear" in what else "ntsc")
    warning = staticmethod(lambda text: print("WARNING", text))
    attributeQuery = staticmethod(
        lambda name, node, exists: name == "jointOrient" or f"{node}.{name}" in cmds.still)
    addAttr = staticmethod(lambda node, longName, dataType: None)
    @classmethod
    def setAttr(cls, name, value, type):
        cls.still[name] = value
    @classmethod
    def setKeyframe(cls, node, **key):
        cls.keyed.append((node, key["attribute"], key["time"], key["value"]))
        seconds = float(key["time"].removesuffix("sec"))
        curve = cls.curves.setdefault(f"{node}.{key['attribute']}", {})
        curve[round(seconds * 30, 4)] = key["value"]
    @classmethod
    def keyframe(cls, node, attribute, query, timeChange=False):
        return sorted(cls.curves.get(f"{node}.{attribute}", ()))
    @classmethod
    def getAttr(cls, name, time=None):
        curve = cls.curves.get(name)
        return cls.still.get(name, 0.0) if curve is None or time is None else curve[time]
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


def in_maya(folder: Path, *calls: str, drivers: dict[str, Any] | None = None) -> str:
    text = script("maya", drivers=drivers).replace("from __future__ import annotations", "")
    return run(folder, "from __future__ import annotations", MAYA, text, *calls)


def test_maya_writes_the_poses_of_keyed_frames(folder: Path) -> None:
    calls = ('key_attributes("curves.json", "face")', 'export_poses("poses.csv", "face")')
    with_all_keys = ("cmds.curves['face.eyeBlinkLeft'] = {0.0: 0.5, 2.4: 0.25}",
                     "cmds.curves['face.JawOpen'] = {0.0: 0.125, 2.4: 0.375}")  # fmt: skip
    printed = in_maya(folder, calls[0], *with_all_keys, calls[1])
    assert "2 poses of frames 0, 2" in printed
    poses = read_poses(folder / "poses.csv")
    assert poses.names == ("JawOpen", "eyeBlinkLeft", "smile")  # a target that is never keyed, too
    assert poses.frames is not None
    assert poses.frames.tolist() == [0, 2]
    assert poses.values.tolist() == [[0.125, 0.5, 0.0], [0.375, 0.25, 0.0]]


DRIVERS = {
    "lookIn": [{"node": "joint", "rotate": [0.0, 25.0, 0.0], "translate": [0.0, 0.0, 0.01]}],
    "lookOut": [{"node": "joint", "rotate": [0.0, -25.0, 0.0]}],
    "lookUp": [{"node": "joint", "rotate": [20.0, 0.0, 0.0]}],
    "wink": [{"node": "rig", "property": "wink", "factor": 100.0, "offset": 5.0}],
    "tongue": [{"node": "tongue", "rotate": [1.0, 0.0, 0.0]}],
}


def test_maya_turns_joints_and_sets_attributes_and_finds_the_controls_again(folder: Path) -> None:
    names = ("lookIn", "lookOut", "lookUp", "wink", "tongue")
    values = np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [0.8, 0.0, 0.0, 0.5, 0.0], [0, 0.6, 0.3, 1, 0.0]])
    write_curves(Take([0.0, 0.1, 0.2], Source(values, names), fps=10.0), folder / "gaze.json")
    printed = in_maya(
        folder,
        'key_attributes("gaze.json", "rig")',
        "print({name: list(curve.values()) for name, curve in cmds.curves.items()})",
        'export_poses("poses.csv", "rig", fps=10)',
        drivers=DRIVERS,
    )
    assert "WARNING no node for drivers: tongue" in printed
    curves = eval(next(line for line in printed.splitlines() if line.startswith("{")))
    assert curves["joint.rotateY"][:2] == pytest.approx([30, 50])  # after what it has at rest
    # Its z lies along x of the scene's, by a half of the turn of 30 degrees; centimetres.
    assert curves["joint.translateY"][:2] == pytest.approx([2, 2 + 0.8 * 0.5])
    assert curves["joint.translateZ"][:2] == pytest.approx([3, 3 + 0.8 * 0.75**0.5])
    assert curves["rig.wink"] == pytest.approx([5, 55, 105])
    poses = read_poses(folder / "poses.csv")
    assert poses.frames is not None
    assert poses.frames.tolist() == [0, 1, 2]
    found = dict(zip(poses.names, poses.values.T, strict=True))
    for column, name in enumerate(names[:3]):
        np.testing.assert_allclose(found[name], values[:, column], atol=1e-5)


def test_maya_says_what_goes_wrong(folder: Path) -> None:
    calls = (
        'key_attributes("none.json", "face")',
        'export_poses("poses.csv", "no")',
        'export_poses("poses.csv", "face")',
        'key_attributes("typo.json", "face")',
    )
    write_curves(Take([0.0], Source([[1.0]], ("jawOpne",)), fps=1.0), folder / "typo.json")
    printed = in_maya(folder, *calls)
    assert "WARNING facert: none.json: expected a file, found nothing" in printed
    assert "WARNING facert: no node 'no'" in printed
    assert "WARNING facert: no frame is keyed: key the poses first" in printed
    assert "WARNING no attribute for 'jawOpne' (did you mean 'JawOpen'?)" in printed
    assert not (folder / "poses.csv").exists()


def test_frames_are_counted_from_those_whose_time_is_known() -> None:
    even = Timeline(30.0)
    assert [even.frame(seconds) for seconds in (0.0, 0.51, -0.01, -1.0)] == [0, 15, 0, None]
    assert even.seconds(15) == 0.5
    # Rows 4 to 9 were lost: frame 4 is at 1 s.
    lost = Timeline(10.0, [*((frame, frame / 10) for frame in range(4)), (4, 1.0), (5, 1.1)])
    assert [lost.frame(seconds) for seconds in (0.3, 0.34, 0.5, 0.94, 1.0, 1.1, 1.2)] == [
        *(3, 3, None, None, 4, 5, 6)
    ]
    assert [lost.seconds(frame) for frame in (3, 4, 6)] == pytest.approx([0.3, 1.0, 1.2])
    few = Timeline(10.0, [(5, 0.5), (9, 2.0)])
    assert [few.frame(seconds) for seconds in (0.0, 0.6, 1.9, 1.2)] == [0, 6, 8, None]


def test_controls_are_found_from_what_they_move() -> None:
    motions = motions_of({name: held for name, held in DRIVERS.items() if name != "tongue"})
    for values in ({"lookIn": 0.7, "lookUp": -0.2}, {"lookOut": 1.2, "wink": 0.4}, {}):
        whole = dict.fromkeys(motions, 0.0) | values
        found = controls_at(motions, added(motions, whole), {})
        assert found == pytest.approx(whole, abs=1e-9)
    sums = added(motions, {"lookIn": 0.5, "lookOut": 0.25, "lookUp": 0.0})
    assert controls_at(motions, sums, {"lookIn": 0.5})["lookOut"] == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize("ending", ["csv", "h5"])
def test_poses_are_labels_of_the_recording(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"poses.{ending}"
    poses = [Pose(frame, frame / 25, {"jäw": frame / 10, "eye": 0.5}) for frame in (3, 8)]
    write_poses(str(path), poses, 25.0)
    recording = Take(np.arange(10) / 25, Source(np.zeros((10, 1)), ("a",)), fps=25.0)
    take = labelled(recording, read_poses(path))
    assert take.labels.tolist() == [3, 8]
    assert take.controls is not None
    assert take.params is not None
    assert take.controls.names == ("jäw", "eye")
    assert take.params[take.labels].tolist() == [[0.3, 0.5], [0.8, 0.5]]
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("text", ["5,41,121", "...\nin order of time: 121 5;41\n", "5, 5,41,121,"])
def test_suggested_frames_in_a_text(text: str) -> None:
    assert [frame for frame, _ in listed_frames(text)] == [5, 41, 121]


@pytest.mark.parametrize("text", ["", "5,41,x", "-3", "1.5"])
def test_a_text_without_frames_is_named(text: str) -> None:
    with pytest.raises(ScriptError, match=r"expected frames such as 5,41,121"):
        listed_frames(text)


@pytest.mark.parametrize("tables", [{"jaw": 1}, {"jaw": [{}]}, {"jaw": {"node": "a", "rotate": 1}}])
def test_drivers_that_are_none(tables: dict[str, Any]) -> None:
    with pytest.raises(ScriptError, match="expected node"):
        motions_of(tables)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"exportFps": 0}, "numbers of seconds"),
        ({"exportFps": -30}, "a rate from 0"),
        ({"exportFps": float("inf")}, "a rate from 0"),
        ({"weightMat": [["0.5"], [1]]}, "a value from .* found '0.5'"),
        ({"weightMat": [[1e300], [1]]}, "a value from"),
        ({"weightMat": [[None], [float("nan")]]}, "expected values, found none"),
        ({"time": [0, float("nan")]}, "seconds from 0"),
        ({"time": [0, 1e12]}, "seconds from 0"),
        ({"time": [1, 0]}, "seconds from 0"),
        ({"time": [0]}, "a value for each time"),
        ({"facsNames": [5]}, "expected named curves"),
    ],
)
def test_curves_of_numbers_that_no_program_takes(tmp_path: Path, changed: Any, message: str):
    document = {"exportFps": 30, "facsNames": ["jawOpen"], "weightMat": [[0.5], [1]]} | changed
    (tmp_path / "a.json").write_text(json.dumps(document))
    with pytest.raises(ScriptError, match=rf"a\.json: expected .*{message}|a\.json: {message}"):
        read_curves(str(tmp_path / "a.json"))


@pytest.mark.parametrize(
    "rows", [[], [[-5, 0]], [[1e400, 0]], [[2**40, 0]], [[5, 1e300]], [[5, float("nan")]]]
)
def test_suggestions_of_no_frames(tmp_path: Path, rows: Any) -> None:
    frames = [{"frame": frame, "seconds": seconds} for frame, seconds in rows]
    (tmp_path / "a.json").write_text(json.dumps({"frames": frames}))
    with pytest.raises(ScriptError, match=r"a\.json: expected "):
        read_suggestions(str(tmp_path / "a.json"))
