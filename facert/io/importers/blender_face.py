"""What facert finds in a scene of Blender: shape keys, and nodes that drivers move."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import bpy
from mathutils import Quaternion, Vector

from facert.io.importers.motions import Motion, Place, Sums, controls_at, motions_of
from facert.io.importers.shared import ScriptError, find, meant, some

REST = "facert_rest"  # of an object: its rotation and location at rest, as a custom property


class Face:
    """The shape keys of some objects, and the bones and objects among them that drivers move.

    Raises `ScriptError` where there is nothing that could be keyed.
    """

    def __init__(self, objects: Iterable[Any], drivers: Mapping[str, Any]) -> None:
        self.objects = list(objects)
        self.warnings: list[str] = []
        bones = [(bone.name, bone) for one in self.objects if one.pose for bone in one.pose.bones]
        self._nodes = dict([(one.name, one) for one in self.objects] + bones)
        self.meshes = self._own_meshes()
        self.motions = self._own_motions(motions_of(drivers))
        nodes = [self.node(place) for place in self.places]
        self._rests = {node.as_pointer(): _rest(node) for node in nodes}
        if not self.meshes and not self.motions:
            text = f"no shape key in {some([one.name for one in self.objects]) or 'the scene'}"
            raise ScriptError("; ".join([text, *self.warnings]))

    @property
    def controls(self) -> list[str]:
        """Their names, each once, as first spelled."""
        names = [name for blocks in self.meshes.values() for name in blocks]
        found: dict[str, str] = {}
        for name in [*names, *self.motions]:
            if find(name, found) is None:
                found[name] = name
        return list(found)

    @property
    def names(self) -> list[str]:
        """The names of the objects that have any of the controls."""
        nodes = [self.node(place).id_data for place in self.places]
        datas = [getattr(one.data, "shape_keys", None) for one in self.objects]
        return [a.name for a, b in zip(self.objects, datas) if b in self.meshes or a in nodes]

    def blocks(self, control: str) -> list[Any]:
        """The shape keys of a control, in any spelling, one a mesh at most."""
        named = [(blocks, find(control, blocks)) for blocks in self.meshes.values()]
        return [blocks[name] for blocks, name in named if name is not None]

    def node(self, place: Place) -> Any:
        """The bone, or else the object, of that name in any spelling."""
        return self._nodes[find(place.node, self._nodes) or ""]

    @property
    def places(self) -> list[Place]:
        """All that drivers move, each once."""
        return list(dict.fromkeys(m.place for found in self.motions.values() for m in found))

    def values(self) -> dict[str, float]:
        """The controls as the scene shows them, drivers and constraints included."""
        found = {}
        for control in self.controls:
            blocks = self.blocks(control)
            if blocks:
                found[control] = float(blocks[0].value)
                if any(abs(block.value - found[control]) > 1e-4 for block in blocks):
                    self._warn(f"{control!r} differs from mesh to mesh: the first counts")
        measured: Sums = {place: self._measured(place) for place in self.places}
        known = {c: value for c in self.motions if (value := self._of(found, c)) is not None}
        return {**controls_at(self.motions, measured, known), **found}

    def rest(self, node: Any) -> tuple[Any, Any]:
        """Rotation and location of a node at rest."""
        return self._rests[node.as_pointer()]

    def _of(self, values: Mapping[str, float], control: str) -> float | None:
        name = find(control, values)
        return None if name is None else values[name]

    def _measured(self, place: Place) -> list[float]:
        node = self.node(place)
        if place.kind == "property":
            return [float(node.path_resolve(property_path(node, place.name)))]
        turned, shifted = self.rest(node)
        shift, turn, _ = _local(node).decompose()
        if place.kind == "rotate":
            axis, angle = (turned.inverted() @ turn).to_axis_angle()
            angle = math.remainder(angle, 2 * math.pi)
            return list(_axes(node, axis * math.degrees(angle), -1))
        return list(_axes(node, turned.inverted() @ (shift - shifted) * _scale(node), -1))

    def _own_meshes(self) -> dict[Any, dict[str, Any]]:
        """The shape keys that can be keyed, by mesh; those that objects share once."""
        found: dict[Any, dict[str, Any]] = {}
        for one in self.objects:
            data = getattr(one.data, "shape_keys", None)
            if data is None or data in found:
                continue
            if data.library is not None:
                self._warn(f"{one.name} is linked from a file: make a library override of it")
                continue
            blocks = [block for block in data.key_blocks if block != data.reference_key]
            found[data] = {block.name: block for block in blocks}
        return found

    def _own_motions(self, motions: dict[str, list[Motion]]) -> dict[str, list[Motion]]:
        """The motions of nodes, and of properties, that are there."""
        missing = {}
        for place in {m.place: None for found in motions.values() for m in found}:
            if find(place.node, self._nodes) is None:
                missing[place] = meant(place.node, self._nodes)
            elif place.kind == "property" and not property_path(self.node(place), place.name):
                missing[place] = f"{place.node!r} with a property {place.name!r}"
        if missing:
            self._warn(
                f"no bone or object for drivers: {some(list(dict.fromkeys(missing.values())))}"
            )
        kept = {c: [m for m in found if m.place not in missing] for c, found in motions.items()}
        return {control: found for control, found in kept.items() if found}

    def _warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)


def property_path(node: Any, name: str) -> str:
    """The path of a custom property, or else of a property of Blender's own; "" without one."""
    path = f'["{bpy.utils.escape_identifier(name)}"]' if name in node else name
    try:
        value = node.path_resolve(path)
    except (ValueError, AttributeError):
        return ""
    return path if isinstance(value, (int, float)) else ""


def _rest(node: Any) -> tuple[Any, Any]:
    """Rotation and location of a node at rest: an object keeps them, else it is at rest now."""
    if isinstance(node, bpy.types.PoseBone):
        return Quaternion(), Vector()
    kept = node.get(REST)
    if kept is None:
        shifted, turned, _ = node.matrix_basis.decompose()
        return turned, shifted
    return Quaternion(kept[:4]), Vector(kept[4:])


def from_rest(node: Any, rest: tuple[Any, Any], kind: str, amount: Sequence[float]) -> Any:
    """The rotation or location of a node that is turned by degrees, or shifted by metres."""
    turned, shifted = rest
    vector = _axes(node, Vector(amount), 1)
    if kind == "rotate":
        return turned @ Quaternion(vector, math.radians(vector.length))
    return shifted + turned @ vector / _scale(node)


def _local(node: Any) -> Any:
    """The matrix of a node in the space of its keys, constraints included."""
    if isinstance(node, bpy.types.PoseBone):
        whole = node.id_data
        return whole.convert_space(
            pose_bone=node, matrix=node.matrix, from_space="POSE", to_space="LOCAL"
        )
    return node.matrix_parent_inverse.inverted() @ node.matrix_local


def _axes(node: Any, vector: Any, way: int) -> Any:
    """A vector of a node's axes in glTF, in its axes in Blender; or back.

    Bones have the same axes in both. Objects stand on another one: y up becomes z up.
    """
    if isinstance(node, bpy.types.PoseBone):
        return vector
    return Vector((vector.x, -way * vector.z, way * vector.y))


def _scale(node: Any) -> float:
    """Metres in the scene of a unit in which a node is shifted."""
    above = node.id_data if isinstance(node, bpy.types.PoseBone) else node.parent
    return float(above.matrix_world.median_scale) if above else 1.0
