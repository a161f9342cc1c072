"""Keys the shape keys of a Blender object with curves that facert wrote (.json or .csv).

In Blender's text editor: set CURVES and OBJECT below and run. From a shell:

    blender face.blend --python import_curves.py -- curves.json Face

Keys are set by time: at another frame rate than the recording's the motion is as fast. Without
OBJECT all objects that have shape keys of such names are keyed, and the bones and properties of
DRIVERS.
"""

from __future__ import annotations

import sys
from typing import Any

import bpy

from facert.io.importers.blender_steps import import_curves
from facert.io.importers.shared import ScriptError

CURVES = ""  # e.g. "/shots/010/curves.json"
OBJECT = ""  # the object with the shape keys; empty: all objects of the scene
START = 1.0  # the frame of the first key
# As in drivers.toml; facert export-script --drivers puts it here.
DRIVERS: dict[str, Any] = {}


def key_shapes(path: str, name: str = "") -> None:
    """Key the shape keys of an object, or of all; print what there is no shape key for."""
    if name and name not in bpy.data.objects:
        raise ScriptError(f"no object {name!r}")
    scene = bpy.context.scene
    objects = [bpy.data.objects[name]] if name else scene.objects
    report = import_curves(scene, objects, DRIVERS, path, START, fit=False)
    print(*report.warnings, report.done, sep="\n")


def _run(*arguments: str) -> None:
    try:
        key_shapes(*arguments)
    except ScriptError as error:
        print(f"facert: {error}")


if CURVES:
    _run(CURVES, OBJECT)
elif "--" in sys.argv:
    _run(*sys.argv[sys.argv.index("--") + 1 :])
