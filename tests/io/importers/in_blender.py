"""What the test of the add-on does inside of Blender, in one start; it writes what came of it.

blender -b --factory-startup --python in_blender.py -- FOLDER
python in_blender.py -- FOLDER        (where bpy is installed)
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
FACTS = json.loads((FOLDER / "facts.json").read_text())
FOUND: dict[str, Any] = {"version": bpy.app.version_string}


def mesh(name: str, shapes: list[str]) -> Any:
    data = bpy.data.meshes.new(name)
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    one = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(one)
    for shape in shapes:
        one.shape_key_add(name=shape).value = 0.0
    return one


def rig() -> Any:
    data = bpy.data.armatures.new("Rig")
    one = bpy.data.objects.new("Rig", data)
    bpy.context.scene.collection.objects.link(one)
    bpy.context.view_layer.objects.active = one
    bpy.ops.object.mode_set(mode="EDIT")
    for name, tail in (("eye_L", (0, -1, 0)), ("jaw", (0, 0.3, 1)), ("slider", (1, 0, 0))):
        bone = data.edit_bones.new(name)
        bone.tail = tail
    bpy.ops.object.mode_set(mode="OBJECT")
    one.pose.bones["jaw"].rotation_mode = "XZY"
    one["wink"] = 0.0
    return one


def character() -> None:
    """Two meshes, a rig with bones and a property, an eyeball that is an object."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="facert_addon")
    mesh("Head", ["Basis", "jawopen", "smile.L", "brow"])
    mesh("Teeth", ["Basis", "jaw_open"])
    rig()
    eye = mesh("eyeball", [])
    eye.rotation_mode = "QUATERNION"
    eye.rotation_quaternion = (0.8, 0.0, 0.6, 0.0)
    eye.location = (1, 2, 3)


def step(name: str, call: Any) -> None:
    """Keep what a call returns, or its message."""
    try:
        FOUND[name] = call()
    except RuntimeError as error:
        FOUND[name] = str(error)


def imported(path: str) -> list[str]:
    return list(bpy.ops.facert.import_curves(filepath=str(FOLDER / path)))


def table(name: str, which: str) -> str:
    bpy.context.scene.facert.frames = which
    bpy.ops.facert.export_poses(filepath=str(FOLDER / name))
    return (FOLDER / name).read_text()


def value(name: str, key: str) -> float:
    return float(bpy.data.objects[name].data.shape_keys.key_blocks[key].value)


def scene() -> list[float]:
    one = bpy.context.scene
    return [one.render.fps, one.render.fps_base, one.frame_start, one.frame_end]


def markers() -> list[list[Any]]:
    return [[m.name, m.frame] for m in bpy.context.scene.timeline_markers]


def curves_in_poses_out() -> None:
    character()
    one = bpy.context.scene
    step("json", lambda: imported("curves.json"))
    FOUND["scene"] = scene()
    one.frame_set(21)
    bones = bpy.data.objects["Rig"].pose.bones
    FOUND["shown"] = {
        "jaw": [value("Head", "jawopen"), value("Teeth", "jaw_open")],
        "smile": value("Head", "smile.L"),
        "wink": bpy.data.objects["Rig"]["wink"],
        "eye": list(bones["eye_L"].matrix_basis.to_quaternion()),
        "ball": list(bpy.data.objects["eyeball"].matrix_basis.to_quaternion()),
        "bone": list(bones["jaw"].location),
    }
    step("keyed", lambda: table("keyed.csv", "KEYED"))
    step("again", lambda: imported("curves.json"))
    step("keyed again", lambda: table("again.csv", "KEYED"))


def markers_and_corrections() -> None:
    character()
    one = bpy.context.scene
    one.render.fps, one.facert.start = 24, 101
    step("marked", lambda: list(bpy.ops.facert.mark_frames(filepath=str(FOLDER / "s.json"))))
    FOUND["markers"] = markers()
    step("poses", lambda: list(bpy.ops.facert.key_poses(filepath=str(FOLDER / "fixed.csv"))))
    step("round trip", lambda: table("back.csv", "KEYED"))
    step("csv", lambda: imported("curves.csv"))
    FOUND["scene of csv"] = scene()
    one.facert.fit = False
    one.render.fps, one.render.fps_base = 60, 1.0
    imported("curves.csv")
    one.frame_set(101 + 20, subframe=0.04)
    FOUND["by time"] = value("Head", "jawopen")
    step("listed", lambda: list(bpy.ops.facert.mark_frames(listed="in order of time: 3, 9")))
    FOUND["list"] = markers()
    step("no take", lambda: list(bpy.ops.facert.mark_frames(filepath=str(FOLDER / "two.json"))))
    two = str(FOLDER / "two.json")
    step("a take", lambda: list(bpy.ops.facert.mark_frames(filepath=two, take="B.csv")))
    FOUND["of two"] = markers()
    bpy.ops.facert.mark_frames(listed="3 9")
    step("one corrected", lambda: list(bpy.ops.facert.key_poses(filepath=str(FOLDER / "one.csv"))))
    FOUND["with corrected"] = markers()
    step("marked out", lambda: table("marked.csv", "MARKED"))
    one.timeline_markers.clear()
    one.timeline_markers.new("mine", frame=50)
    step("before the start", lambda: table("none.csv", "MARKED"))


def messages() -> None:
    character()
    for name in ("missing.json", "foreign.json", "phone.csv", "bytes.csv", "none.json", "wide.csv"):
        step(name, lambda name=name: imported(name))
    step("nothing keyed", lambda: table("none.csv", "KEYED"))
    step("bad list", lambda: list(bpy.ops.facert.mark_frames(listed="five")))
    imported("curves.json")
    step("h5", lambda: list(bpy.ops.facert.export_poses(filepath=str(FOLDER / "poses.h5"))))
    bpy.context.scene.facert.scope = "SELECTED"
    bpy.ops.object.select_all(action="DESELECT")
    step("nothing selected", lambda: imported("curves.json"))
    bpy.context.scene.facert.scope = "ALL"
    bpy.context.scene.facert.drivers = str(FOLDER / "drivers.toml")
    step("chosen drivers", lambda: imported("curves.json"))


def undone() -> None:
    character()
    data = bpy.data.objects["Head"].data.shape_keys
    bpy.ops.ed.undo_push(message="before")
    imported("curves.json")
    FOUND["keyed before undo"] = data.animation_data is not None
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    data = bpy.data.objects["Head"].data.shape_keys
    FOUND["keyed after undo"] = data.animation_data is not None


def driven_and_linked() -> None:
    """A slider bone moves a shape by a driver of Blender's; a head comes from another file."""
    character()
    data, bones = bpy.data.objects["Head"].data.shape_keys, bpy.data.objects["Rig"].pose.bones
    driver = data.key_blocks["brow"].driver_add("value").driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.type = "TRANSFORMS"
    variable.targets[0].id, variable.targets[0].bone_target = bpy.data.objects["Rig"], "slider"
    variable.targets[0].transform_type, variable.targets[0].transform_space = "LOC_X", "LOCAL_SPACE"
    for frame, place in ((4, 0.25), (11, 0.5)):
        bones["slider"].location[0] = place
        bones["slider"].keyframe_insert("location", frame=frame)
    step("driven out", lambda: table("driven.csv", "KEYED"))
    step("driven in", lambda: imported("brow.json"))
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "scene.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="facert_addon")
    with bpy.data.libraries.load(str(FOLDER / "scene.blend"), link=True) as (_, there):
        there.objects = ["Head"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Head"])
    step("linked", lambda: imported("curves.json"))


def by_script() -> None:
    character()
    sys.argv = ["blender", "--", str(FOLDER / "curves.json"), "Teeth"]
    exec(compile((FOLDER / "import_curves.py").read_text(), "import_curves.py", "exec"), {})
    bpy.context.scene.frame_set(3)
    FOUND["script"] = [value("Teeth", "jaw_open"), value("Head", "jawopen"), *scene()]


bpy.ops.preferences.addon_install(filepath=str(FOLDER / "facert_addon.py"))
bpy.ops.preferences.addon_enable(module="facert_addon")
FOUND["panel"] = bpy.types.FACERT_PT_panel.bl_category
for part in (
    curves_in_poses_out,
    markers_and_corrections,
    messages,
    undone,
    driven_and_linked,
    by_script,
):
    part()
bpy.ops.preferences.addon_disable(module="facert_addon")
FOUND["disabled"] = not hasattr(bpy.types, "FACERT_PT_panel")
(FOLDER / "found.json").write_text(json.dumps(FOUND))
