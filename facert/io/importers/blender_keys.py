"""Sets keys in Blender, and finds those that are set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import bpy

from facert.io.importers.blender_face import REST, Face, from_rest, property_path
from facert.io.importers.motions import Place, added
from facert.io.importers.shared import ScriptError, find, meant, some

Points = list[tuple[float, float]]
HARD_LIMIT = 10.0  # Blender's, of the slider of a shape key
_ROTATIONS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}


def key_controls(face: Face, points: Mapping[str, Points], anew: bool) -> list[str]:
    """Key the controls that a face has; return notes on the others.

    Keys that are there give way to the new ones at the same frames, and `anew` all of them.

    Raises `ScriptError` when the face has none of the controls.
    """
    absent = [c for c in points if not face.blocks(c) and find(c, face.motions) is None]
    taken = [find(control, face.controls) for control in points]
    free = [control for control in face.controls if control not in taken]
    missing = [meant(name, free) for name in absent]
    if points and len(absent) == len(points):
        theirs, ours = some(missing), some(face.controls)
        raise ScriptError(f"no shape key for {theirs}; those of the objects are {ours}")
    driven, beyond = [], []
    for control, found in points.items():
        for block in face.blocks(control):
            if _is_driven(block):
                driven.append(block.name)
            elif found:
                _key_block(block, found, anew)
                if any(abs(value) > HARD_LIMIT for _, value in found):
                    beyond.append(f"{control!r}")
    _key_nodes(face, points, anew)
    return _said(missing, driven, beyond)


def keyed_frames(face: Face) -> list[float]:
    """The frames with a key of a shape, of a driven node, or of what Blender's drivers read."""
    found: set[float] = set()
    for data in face.meshes:
        found |= _frames(data, "key_blocks[")
        for driver in data.animation_data.drivers if data.animation_data else ():
            for target in [t for v in driver.driver.variables for t in v.targets if t.id]:
                bone = f'"{bpy.utils.escape_identifier(target.bone_target)}"'
                found |= _frames(target.id, bone if target.bone_target else target.data_path)
    for place in face.places:
        node = face.node(place)
        found |= _frames(node.id_data, _prefix(node))
    return sorted(found)


def _said(missing: list[str], driven: list[str], beyond: list[str]) -> list[str]:
    texts = {
        "no shape key for {}": missing,
        "left alone, as drivers of Blender move them: {}": list(dict.fromkeys(driven)),
        "beyond what Blender's sliders hold (are they percent?): {}": list(dict.fromkeys(beyond)),
    }
    return [text.format(some(names)) for text, names in texts.items() if names]


def _key_block(block: Any, points: Points, anew: bool) -> None:
    # Blender keeps a value within the limits of its slider.
    block.slider_min = min([block.slider_min, *(value for _, value in points)])
    block.slider_max = max([block.slider_max, *(value for _, value in points)])
    _key(block, "value", points, anew)


def _key_nodes(face: Face, points: Mapping[str, Points], anew: bool) -> None:
    """Key what drivers move by all controls together, at every frame that has a key of one."""
    named = {control: find(control, points) for control in face.motions}
    there = {control: dict(points[name]) for control, name in named.items() if name is not None}
    tracks: dict[Place, list[tuple[float, list[float]]]] = {}
    values = dict.fromkeys(there, 0.0) if anew else face.values()
    for frame in sorted({frame for held in there.values() for frame in held}):
        values |= {c: held[frame] for c, held in there.items() if frame in held}
        sums = added(face.motions, {c: values.get(c, 0.0) for c in face.motions})
        for place in {m.place: None for c in there for m in face.motions[c]}:
            tracks.setdefault(place, []).append((frame, sums[place]))
    for place, track in tracks.items():
        _key_node(face, place, track, anew)


def _key_node(
    face: Face, place: Place, track: Sequence[tuple[float, list[float]]], anew: bool
) -> None:
    node = face.node(place)
    if place.kind == "property":
        path = property_path(node, place.name)
        _key(node, path, [(frame, value) for frame, (value,) in track], anew)
        return
    rest = face.rest(node)
    if isinstance(node, bpy.types.Object):
        node[REST] = [*rest[0], *rest[1]]
    path, last = "location", None
    if place.kind == "rotate":
        path = _ROTATIONS.get(node.rotation_mode, "rotation_euler")
    rows = []
    for frame, amount in track:
        last = _numbers(node, path, from_rest(node, rest, place.kind, amount), last)
        rows.append((frame, list(last)))
    for index in range(len(rows[0][1])):
        _key(node, path, [(frame, row[index]) for frame, row in rows], anew, index)


def _numbers(node: Any, path: str, found: Any, last: Any) -> Any:
    """A rotation in the form that a node has it in, next to the last; or a location."""
    if path == "rotation_quaternion":
        if last is not None:
            found.make_compatible(last)
        return found
    if path == "rotation_axis_angle":
        axis, angle = found.to_axis_angle()
        return [angle, *axis]
    if path == "rotation_euler":
        order = node.rotation_mode
        return found.to_euler(order) if last is None else found.to_euler(order, last)
    return found


def _key(owner: Any, path: str, points: Points, anew: bool, index: int = -1) -> None:
    """Set all keys of a property at once, which is many times as fast as one by one."""
    try:
        owner.keyframe_insert(path, index=index, frame=points[0][0])
    except (RuntimeError, TypeError) as error:
        raise ScriptError(f"{owner.id_data.name}: cannot be keyed: {error}") from error
    joint = "" if path.startswith("[") or not _prefix(owner) else "."
    curve = curves_of(owner.id_data).find(f"{_prefix(owner)}{joint}{path}", index=max(index, 0))
    if anew:
        curve.keyframe_points.clear()
        curve.keyframe_points.add(len(points))
        curve.keyframe_points.foreach_set("co", [number for point in points for number in point])
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    else:
        for frame, value in points:
            curve.keyframe_points.insert(frame, value)
    curve.update()


def curves_of(owner: Any) -> Any:
    """The animation curves of an object or data; Blender 5 has them in the layers of an action."""
    animation = owner.animation_data
    action = animation.action if animation else None
    if action is None:
        return []
    if hasattr(action, "fcurves"):
        return action.fcurves
    strips = [strip for layer in action.layers for strip in layer.strips]
    bags = [strip.channelbag(animation.action_slot) for strip in strips]
    return next((bag.fcurves for bag in bags if bag is not None), [])


def _frames(owner: Any, path: str) -> set[float]:
    """Frames with keys of the curves of an owner whose paths have that in them."""
    curves: Iterator[Any] = (curve for curve in curves_of(owner) if path in curve.data_path)
    return {point.co[0] for curve in curves for point in curve.keyframe_points}


def _prefix(owner: Any) -> str:
    return "" if owner == owner.id_data else str(owner.path_from_id())


def _is_driven(block: Any) -> bool:
    animation = block.id_data.animation_data
    return bool(animation) and animation.drivers.find(block.path_from_id("value")) is not None
