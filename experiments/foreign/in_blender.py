"""What Blender does: faces made and exported, facert's files imported.

It runs in Blender's Python, which has NumPy and not facert:

    blender --background --factory-startup --python in_blender.py -- FOLDER
    python in_blender.py -- FOLDER        (where bpy is installed)

FOLDER has the face (`face.npz`, y up), and may have files of facert's. Exports are written into it,
and `truth.npz`: where Blender itself has the vertices, as glTF turns them (y up, metres).
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

if not hasattr(np, "bool"):
    np.bool = bool  # Blender 3.4 as Debian packs it, with a newer NumPy, cannot import without

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
FACE = dict(np.load(FOLDER / "face.npz"))
NAMES = [str(name) for name in FACE["names"]]
TRUTH: dict[str, Any] = {}


def begin(fps: int = 24, base: float = 1.0) -> None:
    """An empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = fps
    bpy.context.scene.render.fps_base = base


def z_up(points: Any) -> Any:
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def y_up(points: Any) -> Any:
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def face(
    name: str = "Face",
    keys: Collection[int] = range(4),
    scale: float = 1.0,
    move: Sequence[float] = (0, 0, 0),
) -> Any:
    """An object with shape keys; its own space is larger by `scale`."""
    vertices = (z_up(FACE["vertices"]) + move) * scale
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], FACE["faces"].tolist())
    mesh.update()
    found = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(found)
    if len(keys):
        found.shape_key_add(name="Basis")
    for index in keys:
        block = found.shape_key_add(name=NAMES[index])
        moved = vertices + z_up(FACE["shapes"][index]) * scale
        block.data.foreach_set("co", moved.ravel())
    return found


def armature(found: Any, scale: float = 0.01) -> Any:
    """Bind an object to an armature of one bone that is scaled and lies on its back."""
    data = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = data.edit_bones.new("head")
    bone.head, bone.tail = (0, 0, 1.4 / scale), (0, 0.05 / scale, 1.6 / scale)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.scale, rig.rotation_euler = (scale,) * 3, (math.pi / 2, 0.3, 0)
    found.parent = rig
    found.modifiers.new("Armature", "ARMATURE").object = rig
    group = found.vertex_groups.new(name="head")
    group.add(list(range(len(found.data.vertices))), 1.0, "REPLACE")
    return rig


def world(objects: Sequence[Any]) -> Any:
    """Vertices of some objects as Blender shows them, (V, 3), y up."""
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    parts = []
    for one in objects:
        shown = one.evaluated_get(graph)
        points = np.empty(3 * len(shown.data.vertices))
        shown.data.vertices.foreach_get("co", points)
        matrix = np.array(shown.matrix_world)
        parts.append(points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])
    return y_up(np.concatenate(parts))


def remember(name: str, objects: Sequence[Any]) -> None:
    """The truth about some objects: at rest, and with each shape key at 1."""
    blocks = [one.data.shape_keys.key_blocks for one in objects if one.data.shape_keys]
    for block in (block for some in blocks for block in some[1:]):
        block.value = 0.0
    rest = world(objects)
    TRUTH[name + "/vertices"] = rest
    for key in NAMES:
        there = [some[key] for some in blocks if key in some]
        for block in there:
            block.value = 1.0
        if there:
            TRUTH[name + "/" + key] = world(objects) - rest
        for block in there:
            block.value = 0.0


def export(name: str, **options: Any) -> None:
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    form = {"export_format": "GLB" if name.endswith(".glb") else "GLTF_SEPARATE"}
    options = {key: value for key, value in {**form, **options}.items() if key in known}
    bpy.ops.export_scene.gltf(filepath=str(FOLDER / name), **options)


def moved() -> None:
    begin()
    one = face()
    one.location, one.rotation_euler, one.scale = (0.1, 2, -0.3), (0.2, 0, 1), (1.5, 1.5, 1.5)
    remember("moved.glb", [one])
    export("moved.glb")
    remember("separate.gltf", [one])
    export("separate.gltf")
    remember("sparse.glb", [one])
    export("sparse.glb", export_try_sparse_sk=True, export_morph_normal=False)


def skinned() -> None:
    begin()
    one = face(scale=100.0)
    armature(one)
    remember("skinned.glb", [one])
    export("skinned.glb")
    armature_moved = bpy.data.objects["Rig"]
    armature_moved.location = (0.5, -1, 0.25)
    remember("skinned_moved.glb", [one])
    export("skinned_moved.glb")


def several() -> None:
    begin()
    parts = [face(), face("Teeth", [0], move=(0, 0.3, 0)), face("Lashes", [1, 2], move=(0.4, 0, 0))]
    face("Eyes", [], move=(0, 0, 1))
    remember("several.glb", parts)
    export("several.glb")


def materials() -> None:
    """A face of two materials, which is exported in two parts."""
    begin()
    one = face()
    one.data.materials.append(bpy.data.materials.new("skin"))
    one.data.materials.append(bpy.data.materials.new("lips"))
    for polygon in one.data.polygons:
        polygon.material_index = polygon.index % 2
    remember("materials.glb", [one])
    export("materials.glb")


def key_weights(one: Any) -> None:
    blocks = one.data.shape_keys.key_blocks
    for frame, row in enumerate(FACE["weights"]):
        for name, value in zip(NAMES, row, strict=True):
            blocks[name].value = value
            blocks[name].keyframe_insert("value", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 0, len(FACE["weights"]) - 1


def animated() -> None:
    for name, fps, base in (
        ("animated_24.glb", 24, 1.0),
        ("animated_23.976.glb", 24, 1.001),
        ("animated_60.glb", 60, 1.0),
    ):
        begin(fps, base)
        key_weights(face())
        export(name)
    begin()
    key_weights(face())
    export("animated_sparse_keys.glb", export_force_sampling=False)
    begin()
    one = face(scale=100.0)
    armature(one)
    key_weights(one)
    export("animated_skinned.glb")


def driven() -> None:
    """Shape keys driven by a bone that is keyed, as control rigs do it."""
    begin()
    one = face(scale=1.0)
    rig = armature(one, scale=1.0)
    for index, name in enumerate(NAMES[:3]):
        driver = one.data.shape_keys.key_blocks[name].driver_add("value").driver
        driver.type = "SCRIPTED"
        variable = driver.variables.new()
        variable.name, variable.type = "v", "TRANSFORMS"
        target = variable.targets[0]
        target.id, target.bone_target = rig, "head"
        target.transform_type = ("LOC_X", "LOC_Y", "LOC_Z")[index]
        target.transform_space = "LOCAL_SPACE"
        driver.expression = "v"
    bone = rig.pose.bones["head"]
    for frame, row in enumerate(FACE["weights"]):
        bone.location = row[:3]
        bone.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 0, len(FACE["weights"]) - 1
    export("driven.glb")


def obj(
    folder: str,
    key: str,
    scale: float = 1.0,
    forward: str = "NEGATIVE_Z",
    up: str = "Y",
    **options: Any,
) -> None:
    (FOLDER / folder).mkdir(exist_ok=True)
    known = bpy.ops.wm.obj_export.get_rna_type().properties.keys()
    size = "global_scale" if "global_scale" in known else "scaling_factor"
    options = {**options, size: scale, "forward_axis": forward, "up_axis": up}
    options = {name: value for name, value in options.items() if name in known}
    bpy.ops.wm.obj_export(filepath=str(FOLDER / folder / f"{key}.obj"), **options)


OBJ: dict[str, dict[str, Any]] = {
    "obj": {},
    "obj_cm": {"scale": 100.0, "export_normals": False, "export_uv": False},
    "obj_z_up": {"forward": "Y", "up": "Z", "export_materials": False},
    "obj_triangles": {"export_triangulated_mesh": True, "export_smooth_groups": True},
    "obj_mixed": {},  # one shape in another space than the rest
    "obj_mixed_scale": {},
}
OTHER: dict[str, dict[str, Any]] = {
    "obj_mixed": {"forward": "Y", "up": "Z"},
    "obj_mixed_scale": {"scale": 100.0},
}


def objs() -> None:
    begin()
    one = face()
    blocks = one.data.shape_keys.key_blocks
    remember("obj", [one])
    for folder, options in OBJ.items():
        obj(folder, "neutral", **options)
        for name in NAMES:
            blocks[name].value = 1.0
            last = folder in OTHER and name == NAMES[-1]
            obj(folder, name, **(OTHER[folder] if last else options))
            blocks[name].value = 0.0


def values(one: Any, times: Any) -> Any:
    """Values of all shape keys at some seconds."""
    scene = bpy.context.scene
    rate = scene.render.fps / scene.render.fps_base
    rows = []
    for moment in times:
        frame = moment * rate
        scene.frame_set(int(frame), subframe=frame - int(frame))
        rows.append([one.data.shape_keys.key_blocks[name].value for name in NAMES])
    return np.array(rows)


def imported() -> None:
    """Play facert's animated .glb and its curves, in scenes of other rates."""
    begin(30)
    bpy.ops.import_scene.gltf(filepath=str(FOLDER / "facert.glb"))
    (one,) = [one for one in bpy.data.objects if one.type == "MESH"]
    bpy.context.scene.frame_set(0)
    TRUTH["facert.glb/weights"] = values(one, FACE["time"])
    for block in one.data.shape_keys.key_blocks[1:]:
        block.value = 0.0
    one.data.shape_keys.animation_data_clear()
    remember("facert.glb", [one])
    for name in ("facert.json", "facert.csv"):
        begin(25)
        one = face()
        code = (FOLDER / "import_curves.py").read_text(encoding="utf-8")
        arguments, sys.argv = sys.argv, ["blender"]
        script: dict[str, Any] = {}
        exec(compile(code, "import_curves.py", "exec"), script)
        sys.argv = arguments
        script["key_shapes"](str(FOLDER / name), "Face")
        later = FACE["time"] + 1 / 25  # the script's first key is at frame 1
        TRUTH[name + "/weights"] = values(one, later)


FAILED: dict[str, str] = {}
for step in (moved, skinned, several, materials, animated, driven, objs, imported):
    try:
        step()
    except Exception as error:
        FAILED[step.__name__] = f"{type(error).__name__}: {error}"
np.savez(FOLDER / "truth.npz", **TRUTH)
result = {"version": bpy.app.version_string, "failed": FAILED}
(FOLDER / "blender.json").write_text(json.dumps(result), encoding="utf-8")
