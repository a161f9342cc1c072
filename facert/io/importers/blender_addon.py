"""facert's add-on for Blender: curves in, poses out, suggested frames, corrected frames.

Install it by Edit > Preferences > Add-ons > Install (in Blender 4.2 and later: Install from Disk).
Its panel is in the sidebar of the 3D view (key N), tab facert.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy_extras.io_utils import ExportHelper, ImportHelper

from facert.io.importers.blender_steps import (
    Report,
    export_poses,
    import_curves,
    key_poses,
    mark_frames,
    scene_rate,
    timeline_of,
)
from facert.io.importers.motions import read_drivers
from facert.io.importers.shared import ScriptError

bl_info = {
    "name": "facert",
    "description": "Facial animation of facert: curves in, poses out, frames to pose",
    "author": "The facert developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > facert; File > Import, Export",
    "category": "Animation",
}

# As in drivers.toml; facert export-script --drivers puts it here.
DRIVERS: dict[str, Any] = {}
_SCOPES = (
    ("ALL", "All objects", "Every object of the scene"),
    ("SELECTED", "Selected", "The selected objects, with all that belongs to their characters"),
)
_FRAMES = (
    ("KEYED", "Keyed frames", "Frames with a key of the face"),
    ("MARKED", "Marked frames", "Frames with a marker in the timeline"),
    ("SELECTED", "Selected markers", "Frames of the markers that are selected"),
)


def _glob(endings: str) -> Any:
    """The endings that a file browser shows."""
    return bpy.props.StringProperty(default=endings, options={"HIDDEN"})


# What bpy gives has no types, and Blender reads plain lists and sets of these classes.
class FacertSettings(bpy.types.PropertyGroup):  # type: ignore[misc]
    """What all steps share; it is kept with the scene."""

    __annotations__ = {
        "start": bpy.props.IntProperty(
            name="First frame",
            description="The scene's frame for frame 0 of the recording",
            default=1,
        ),
        "scope": bpy.props.EnumProperty(name="Objects", items=_SCOPES, default="ALL"),
        "fit": bpy.props.BoolProperty(
            name="Set rate and range",
            description="To those of the curves; else the curves are keyed by time",
            default=True,
        ),
        "frames": bpy.props.EnumProperty(name="Frames", items=_FRAMES, default="KEYED"),
        "drivers": bpy.props.StringProperty(
            name="Drivers",
            description="drivers.toml, for controls that are bones, objects or properties",
            subtype="FILE_PATH",
        ),
    }


class FACERT_OT_import_curves(bpy.types.Operator, ImportHelper):  # type: ignore[misc]
    """Key a face with curves that facert wrote; keys that were there are replaced."""

    bl_idname = "facert.import_curves"
    bl_label = "Import curves"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    __annotations__ = {"filter_glob": _glob("*.json;*.csv")}

    def draw(self, context: Any) -> None:
        """Show the settings beside the files."""
        _draw(self.layout, context, "start", "fit", "scope", "drivers")

    def execute(self, context: Any) -> set[str]:
        """Import; a trouble is reported, and undone by Blender."""
        one = context.scene.facert
        return _report(
            self,
            lambda: import_curves(
                context.scene, _objects(context), _drivers(one), self.filepath, one.start, one.fit
            ),
        )


class FACERT_OT_export_poses(bpy.types.Operator, ExportHelper):  # type: ignore[misc]
    """Write the poses of keyed or marked frames, for facert convert --poses."""

    bl_idname = "facert.export_poses"
    bl_label = "Export poses"
    filename_ext = ".csv"
    __annotations__ = {"filter_glob": _glob("*.csv")}

    def draw(self, context: Any) -> None:
        """Show the settings beside the files."""
        _draw(self.layout, context, "start", "frames", "scope", "drivers")

    def execute(self, context: Any) -> set[str]:
        """Export; a trouble is reported."""
        one = context.scene.facert
        return _report(
            self,
            lambda: export_poses(
                context.scene,
                _objects(context),
                _drivers(one),
                self.filepath,
                one.start,
                one.frames,
            ),
        )


class FACERT_OT_mark_frames(bpy.types.Operator, ImportHelper):  # type: ignore[misc]
    """Set a marker at each frame that facert suggest names, from its --json or its list."""

    bl_idname = "facert.mark_frames"
    bl_label = "Mark suggested frames"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    __annotations__ = {
        "filter_glob": _glob("*.json;*.txt"),
        "listed": bpy.props.StringProperty(
            name="Or a list", description="Frames such as 5,41,121, in the place of a file"
        ),
        "take": bpy.props.StringProperty(
            name="Take", description="Of suggestions for several takes: that of this timeline"
        ),
    }

    def draw(self, context: Any) -> None:
        """Show the settings beside the files."""
        self.layout.prop(self, "listed")
        self.layout.prop(self, "take")
        _draw(self.layout, context, "start")

    def execute(self, context: Any) -> set[str]:
        """Mark the frames; a trouble is reported."""
        scene = context.scene
        given = (self.filepath, self.listed, self.take, scene.facert.start)
        return _report(self, lambda: mark_frames(scene, *given))


class FACERT_OT_key_poses(bpy.types.Operator, ImportHelper):  # type: ignore[misc]
    """Key the poses of a table at their frames, and mark these; other keys stay."""

    bl_idname = "facert.key_poses"
    bl_label = "Key poses"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    __annotations__ = {"filter_glob": _glob("*.csv;*.json")}

    def draw(self, context: Any) -> None:
        """Show the settings beside the files."""
        _draw(self.layout, context, "start", "scope", "drivers")

    def execute(self, context: Any) -> set[str]:
        """Key the poses; a trouble is reported."""
        one = context.scene.facert
        return _report(
            self,
            lambda: key_poses(
                context.scene, _objects(context), _drivers(one), self.filepath, one.start
            ),
        )


class FACERT_PT_panel(bpy.types.Panel):  # type: ignore[misc]
    """The steps in the order of a day."""

    bl_label = "facert"
    bl_idname = "FACERT_PT_panel"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "facert"

    def draw(self, context: Any) -> None:
        """Show the settings, and a button a step."""
        _draw(self.layout, context, "start", "scope", "drivers")
        for title, icon, step, names in (
            ("Pose", "MARKER", FACERT_OT_mark_frames, ()),
            ("", "EXPORT", FACERT_OT_export_poses, ("frames",)),
            ("Animate", "IMPORT", FACERT_OT_import_curves, ("fit",)),
            ("Correct", "KEYINGSET", FACERT_OT_key_poses, ()),
        ):
            if title:
                self.layout.separator()
                self.layout.label(text=title)
            _draw(self.layout, context, *names)
            self.layout.operator(step.bl_idname, icon=icon)
        line, rate = timeline_of(context.scene), scene_rate(context.scene)
        self.layout.separator()
        self.layout.label(text=f"Take {line.rate:.5g} fps, scene {rate:.5g}")


_CLASSES = (
    FacertSettings,
    FACERT_OT_import_curves,
    FACERT_OT_export_poses,
    FACERT_OT_mark_frames,
    FACERT_OT_key_poses,
    FACERT_PT_panel,
)


def register() -> None:
    """Called by Blender as it enables the add-on."""
    for one in _CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.facert = bpy.props.PointerProperty(type=FacertSettings)
    bpy.types.TOPBAR_MT_file_import.append(_in_import_menu)
    bpy.types.TOPBAR_MT_file_export.append(_in_export_menu)


def unregister() -> None:
    """Called by Blender as it disables the add-on."""
    bpy.types.TOPBAR_MT_file_export.remove(_in_export_menu)
    bpy.types.TOPBAR_MT_file_import.remove(_in_import_menu)
    del bpy.types.Scene.facert
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)


def _in_import_menu(menu: Any, _: Any) -> None:
    menu.layout.operator(FACERT_OT_import_curves.bl_idname, text="facert curves (.json, .csv)")


def _in_export_menu(menu: Any, _: Any) -> None:
    menu.layout.operator(FACERT_OT_export_poses.bl_idname, text="facert poses (.csv)")


def _draw(layout: Any, context: Any, *names: str) -> None:
    for name in names:
        # What a choice is for its words say; the panel is narrow.
        plain = {"text": ""} if name in ("scope", "frames") else {}
        layout.prop(context.scene.facert, name, **plain)


def _report(operator: Any, step: Callable[[], Report]) -> set[str]:
    """Carry a step out, with messages in the place of tracebacks."""
    try:
        report = step()
    except ScriptError as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    for text in report.warnings:
        operator.report({"WARNING"}, text)
    operator.report({"INFO"}, report.done)
    return {"FINISHED"}


def _objects(context: Any) -> list[Any]:
    """The objects of the scene, or those of the characters that are selected."""
    everything = list(context.scene.objects)
    if context.scene.facert.scope == "ALL":
        return everything
    roots = {_root(one) for one in everything if one.select_get()}
    if not roots:
        raise ScriptError("no object is selected: select the character, or choose all objects")
    return [one for one in everything if _root(one) in roots]


def _root(one: Any) -> Any:
    """The object on top of an object, by parents or the armature that moves it."""
    rigs = [m.object for m in one.modifiers if m.type == "ARMATURE" and m.object]
    above = one.parent or next(iter(rigs), None)
    return one if above is None else _root(above)


def _drivers(settings: Any) -> dict[str, Any]:
    """The drivers in a chosen file, or else those that this file holds."""
    path = bpy.path.abspath(settings.drivers)
    return read_drivers(path) if path else DRIVERS
