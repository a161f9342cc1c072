"""The add-on and the script do in real Blender what they are for, all in one start of it.

``FACERT_BLENDER`` names another Blender, or a Python that has bpy, than the one on the path.
"""

from __future__ import annotations

import csv
import importlib.util
import io
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facert.data.take import Source, Take
from facert.io.formats import read_take_file, write_take_file
from facert.io.importers import script
from facert.io.poses import read_poses

FPS, FRAMES = 30000 / 1001, 40
NAMES = ("jawOpen", "smileLeft", "brrow", "lookIn", "lookOut", "lookUp", "wink")
STEPS = np.arange(FRAMES)
WAVE = np.sin(STEPS / 5)
VALUES = np.stack(
    [
        0.5 + 0.5 * np.cos(STEPS / 7),
        STEPS / 30,  # beyond 1
        0.1 * STEPS,
        np.maximum(WAVE, 0),
        np.maximum(-WAVE, 0),
        np.full(FRAMES, 0.3),
        STEPS / 100,
    ],
    axis=1,
)
DRIVERS: dict[str, Any] = {
    "lookIn": [
        {"node": "eye_L", "rotate": [0.0, 0.0, 25.0]},
        {"node": "eyeball", "rotate": [0.0, 25.0, 0.0]},
    ],
    "lookOut": [
        {"node": "eye_L", "rotate": [0.0, 0.0, -25.0]},
        {"node": "eyeball", "rotate": [0.0, -25.0, 0.0]},
    ],
    "lookUp": [{"node": "eye_L", "rotate": [20.0, 0.0, 0.0]}],
    "jawOpen": [{"node": "jaw", "rotate": [15.0, 0.0, 0.0], "translate": [0.0, 0.0, 0.1]}],
    "wink": [{"node": "Rig", "property": "wink", "factor": 100.0, "offset": 5.0}],
    "tongue": [{"node": "Tongue", "rotate": [1.0, 0.0, 0.0]}],
}
TIME = STEPS / FPS


def hosts() -> list[list[str]]:
    """Commands that run a script in Blender."""
    given = [os.environ["FACERT_BLENDER"]] if os.environ.get("FACERT_BLENDER") else []
    found = given or [path for path in [shutil.which("blender")] if path]
    bpy = [sys.executable] if not given and importlib.util.find_spec("bpy") else []
    plain = [*(one for one in found if "python" in Path(one).name), *bpy]
    return [[one] for one in plain] + [
        [one, "-b", "--factory-startup", "--python"] for one in found if one not in plain
    ]


def write_files(folder: Path) -> None:
    (folder / "facts.json").write_text("{}")
    (folder / "facert_addon.py").write_text(script("blender", addon=True, drivers=DRIVERS))
    (folder / "import_curves.py").write_text(script("blender"))
    take = Take(TIME, Source(VALUES, NAMES), fps=FPS)
    for ending in ("json", "csv"):
        write_take_file(take, folder / f"curves.{ending}")
    brow = Take([0.0, 0.1], Source([[0.1], [0.9]], ("brow",)), fps=10.0)
    write_take_file(brow, folder / "brow.json")
    other = Take([0.0, 0.1], Source([[0.1], [0.9]], ("jawOpne",)), fps=10.0)
    write_take_file(other, folder / "none.json")
    rows = [{"frame": frame, "seconds": frame / FPS, "share": 0.1} for frame in (30, 5, 12)]
    (folder / "s.json").write_text(json.dumps({"file": "take.csv", "frames": rows}))
    named = [{"frame": f, "seconds": f / FPS, "file": name} for f, name in ((3, "A"), (9, "B.csv"))]
    (folder / "two.json").write_text(json.dumps({"files": ["A", "B.csv"], "frames": named}))
    (folder / "fixed.csv").write_text("frame,jawOpen,lookIn,lookOut,lookUp,wink\n"
                                      "5,0.5,0,0.75,0,0.1\n12,0.25,0.5,0,0.4,0.2\n")  # fmt: skip
    (folder / "one.csv").write_text("frame,jawOpen,lookIn\n9,0.125,0.625\n")
    (folder / "foreign.json").write_text('{"a": 1}')
    (folder / "phone.csv").write_text("Timecode,BlendShapeCount,JawOpen\n10:00:00:00,61,0.1\n")
    (folder / "bytes.csv").write_bytes(bytes(range(256)))
    (folder / "wide.csv").write_text("time,jawOpen\n0,0.1\n1,0.2,0.3\n")
    (folder / "drivers.toml").write_text('[[lookIn]]\nnode = "eye_L"\nrotate = [0, 0, 25]\n')


@pytest.fixture(name="blender", scope="module", params=hosts() or [None], ids=str)
def _blender(request, tmp_path_factory) -> tuple[Path, dict[str, Any], str]:
    """The folder, what Blender found, and what it printed."""
    if request.param is None:
        pytest.skip("neither Blender nor bpy is installed here")
    folder = tmp_path_factory.mktemp("blender")
    write_files(folder)
    scenario = Path(__file__).with_name("in_blender.py")
    places = {f"BLENDER_USER_{kind}": str(folder / kind) for kind in ("SCRIPTS", "CONFIG")}
    (folder / "SCRIPTS" / "addons").mkdir(parents=True)
    done = subprocess.run(
        [*request.param, str(scenario), "--", str(folder)],
        env={**os.environ, **places, "BLENDER_USER_RESOURCES": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    printed = done.stdout + done.stderr
    assert (folder / "found.json").exists(), printed[-2000:]
    return folder, json.loads((folder / "found.json").read_text()), printed


def rows_of(text: str) -> list[dict[str, float]]:
    return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(io.StringIO(text))]


def turn(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    half = math.radians(degrees) / 2
    return np.array([math.cos(half), *(math.sin(half) * np.array(axis))])


def test_it_is_installed_with_a_panel_and_removed(blender) -> None:
    _, found, _ = blender
    assert found["panel"] == "facert"
    assert found["disabled"]


def test_curves_move_all_meshes_bones_objects_and_properties(blender) -> None:
    _, found, printed = blender
    assert found["json"] == found["again"] == ["FINISHED"]
    assert found["scene"] == pytest.approx([30, 1.001, 1, FRAMES])
    shown, values = found["shown"], dict(zip(NAMES, VALUES[20], strict=True))
    assert shown["jaw"] == pytest.approx([values["jawOpen"]] * 2, abs=1e-6)
    assert shown["smile"] == pytest.approx(values["smileLeft"], abs=1e-6)
    assert shown["wink"] == pytest.approx(5 + 100 * values["wink"], abs=1e-4)
    side = 25 * (values["lookIn"] - values["lookOut"])
    up = 20 * values["lookUp"]
    size = math.hypot(side, up)
    assert shown["eye"] == pytest.approx(turn((up / size, 0, side / size), size), abs=1e-5)
    # An object's y up is z up in Blender; it turns about its own axes, from where it was.
    rest, half = np.array([0.8, 0, 0.6, 0]), turn((0, 0, 1), side)
    w, z = half[0], half[3]
    whole = [rest[0] * w, rest[2] * z, rest[2] * w, rest[0] * z]
    assert shown["ball"] == pytest.approx(whole, abs=1e-5)
    assert shown["bone"] == pytest.approx([0, 0, 0.1 * values["jawOpen"]], abs=1e-5)
    assert "no shape key for 'brrow' (did you mean 'brow'?)" in printed
    assert "no bone or object for drivers: 'Tongue'" in printed
    assert "40 frames at 29.97 frames/s, keyed on Head, Teeth" in printed


def test_the_poses_of_keyed_frames_are_those_that_came_in(blender) -> None:
    folder, found, _ = blender
    rows = rows_of(found["keyed"])
    assert [row["frame"] for row in rows] == list(range(FRAMES))
    spelled = {**{name: name for name in NAMES}, "jawOpen": "jawopen", "smileLeft": "smile.L"}
    for column, name in enumerate(NAMES):
        if name != "brrow":
            read = [row[spelled[name]] for row in rows]
            np.testing.assert_allclose(read, VALUES[:, column], atol=2e-5)
    assert "brow" not in rows[0]  # which the curves do not have, and no pose moves
    assert found["keyed again"] == found["keyed"]
    poses = read_poses(folder / "keyed.csv")
    assert poses.frames is not None
    assert poses.frames.tolist() == list(range(FRAMES))


def test_suggested_frames_are_marked_by_time_at_another_rate(blender) -> None:
    _, found, _ = blender
    assert found["marked"] == ["FINISHED"]
    places = [[f"facert {f}", 101 + round(f / FPS * 24)] for f in (5, 12, 30)]
    assert found["markers"] == places
    assert found["of two"] == [["facert 9", 101 + round(9 / FPS * 60)]]
    assert found["list"] == [["facert 3", 101 + 6], ["facert 9", 101 + 18]]


def test_corrected_frames_are_keyed_alone_and_come_back(blender) -> None:
    _, found, _ = blender
    assert found["poses"] == ["FINISHED"]
    rows = rows_of(found["round trip"])
    assert [row["frame"] for row in rows] == [5, 12]
    assert [row["jawopen"] for row in rows] == [0.5, 0.25]
    assert [row["brow"] for row in rows] == [0.0, 0.0]
    for name, there in {"lookIn": (0, 0.5), "lookOut": (0.75, 0), "lookUp": (0, 0.4)}.items():
        assert [row[name] for row in rows] == pytest.approx(there, abs=2e-5)
    assert [row["wink"] for row in rows] == pytest.approx([0.1, 0.2], abs=1e-5)
    assert found["with corrected"] == found["list"]  # frame 9 has a marker
    rows = rows_of(found["marked out"])
    assert [row["frame"] for row in rows] == [3, 9]
    assert [row["jawopen"] for row in rows] == pytest.approx([VALUES[3, 0], 0.125], abs=1e-3)
    assert rows[1]["lookIn"] == pytest.approx(0.625, abs=1e-4)
    assert rows[1]["lookUp"] == pytest.approx(0.3, abs=1e-4)  # as the scene had it


def test_curves_are_keyed_by_time_and_the_scene_is_set_only_when_asked(blender) -> None:
    _, found, _ = blender
    assert found["csv"] == ["FINISHED"]
    assert found["scene of csv"] == pytest.approx([30, 1.001, 101, 100 + FRAMES])
    assert found["by time"] == pytest.approx(VALUES[10, 0], abs=1e-3)
    teeth, head, *scene = found["script"]
    assert teeth == pytest.approx(np.interp(2 / 24, TIME, VALUES[:, 0]), abs=1e-4)
    assert head == 0.0  # another object than the one that was named
    assert scene == [24, 1.0, 1, 250]


MESSAGES = {
    "missing.json": "missing.json: expected a file, found nothing",
    "foreign.json": "foreign.json: expected a file that facert wrote, found something else",
    "phone.csv": "phone.csv: expected a column time, found Timecode, BlendShapeCount, JawOpen",
    "bytes.csv": "bytes.csv: expected a file that facert wrote",
    "wide.csv": "wide.csv: row 2: expected 2 values, found 3",
    "none.json": "no shape key for 'jawOpne' (did you mean 'jawopen'?)",
    "nothing keyed": "no frame is keyed: key the poses first",
    "before the start": "all frames are before the recording's first, which is at 101",
    "bad list": "expected frames such as 5,41,121, found 'five'",
    "no take": "two.json: expected one of the takes A, B.csv, found 'none'",
    "nothing selected": "no object is selected",
    "linked": "Head is linked from a file: make a library override of it",
}


@pytest.mark.parametrize("name", MESSAGES)
def test_what_goes_wrong_is_a_message_and_no_traceback(blender, name) -> None:
    _, found, printed = blender
    assert MESSAGES[name] in found[name]
    assert "Traceback" not in printed


def test_undo_takes_the_keys_away(blender) -> None:
    _, found, _ = blender
    assert found["keyed before undo"]
    assert not found["keyed after undo"]


def test_sliders_of_the_rig_are_seen_and_left_alone(blender) -> None:
    _, found, printed = blender
    rows = rows_of(found["driven out"])
    assert [row["frame"] for row in rows] == [3, 10]
    assert [row["brow"] for row in rows] == pytest.approx([0.25, 0.5], abs=1e-5)
    assert "left alone, as drivers of Blender move them: brow" in printed


def test_drivers_of_a_file_count_where_its_python_reads_toml(blender) -> None:
    _, found, _ = blender
    there = found["chosen drivers"]
    assert there == ["FINISHED"] or "facert export-script --drivers" in there


def test_poses_go_to_hdf5_where_its_python_can(blender) -> None:
    folder, found, _ = blender
    if found["h5"] == ["FINISHED"]:
        assert len(read_poses(folder / "poses.h5").values) == FRAMES
    else:
        assert "this program's Python has no h5py for a .h5: write a .csv" in found["h5"]


def test_poses_of_blender_become_labels(blender, tmp_path) -> None:
    from facert.data.labelling import labelled

    folder, _, _ = blender
    take = labelled(read_take_file(folder / "curves.json"), read_poses(folder / "back.csv"))
    assert take.labels.tolist() == [5, 12]
