"""Keys the shape keys of a Blender object with curves that facert wrote (.json or .csv).

In Blender's text editor: set CURVES and OBJECT below and run. From a shell:

    blender face.blend --python import_curves.py -- curves.json Face

Keys are set by time: at another frame rate than the recording's the motion is as fast.
"""

from __future__ import annotations

import sys
from typing import Any

import bpy

from facert.io.importers.shared import find, keys, read_curves

CURVES = ""  # e.g. "/shots/010/curves.json"
OBJECT = ""  # the object with the shape keys; empty: the active one
START = 1.0  # the frame of the first key


def key_shapes(path: str, name: str = "") -> None:
    """Key the shape keys of an object; print the curves that it has no shape key for."""
    face = bpy.data.objects[name] if name else bpy.context.active_object
    shapes = face.data.shape_keys
    render = bpy.context.scene.render
    rate = render.fps / render.fps_base
    curves = read_curves(path)
    for control in curves.values:
        found = find(control, shapes.key_blocks.keys())
        if found is None:
            print(f"no shape key for {control!r}")
            continue
        block, there = shapes.key_blocks[found], keys(curves, control)
        points = [(START + (key.time - curves.time[0]) * rate, key.value) for key in there]
        # Blender keeps a value within the limits of its slider.
        block.slider_min = min([block.slider_min, *(value for _, value in points)])
        block.slider_max = max([block.slider_max, *(value for _, value in points)])
        _key(shapes, block, points)
    print(f"{len(curves.time)} frames at {curves.fps:g} frames/s on {rate:g} frames/s")


def _key(shapes: Any, block: Any, points: list[tuple[float, float]]) -> None:
    """Set all keys of a shape at once, which is many times as fast as one by one."""
    if not points:
        return
    block.value = points[0][1]
    block.keyframe_insert("value", frame=points[0][0])
    curve = _curves(shapes.animation_data).find(block.path_from_id("value"))
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(points))
    curve.keyframe_points.foreach_set("co", [number for point in points for number in point])
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
    curve.update()


def _curves(animation: Any) -> Any:
    """The curves of an action; Blender 5 has them in the layers of the action."""
    if hasattr(animation.action, "fcurves"):
        return animation.action.fcurves
    return animation.action.layers[0].strips[0].channelbag(animation.action_slot).fcurves


if CURVES:
    key_shapes(CURVES, OBJECT)
elif "--" in sys.argv:
    key_shapes(*sys.argv[sys.argv.index("--") + 1 :])
