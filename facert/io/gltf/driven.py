"""Nodes of a glTF file that drivers turn and shift."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.driven_nodes import DrivenNodes
from facert.data.drivers import Driver, Drivers
from facert.data.names import NameIndex, nearest
from facert.data.text import listed, printable
from facert.errors import InputError
from facert.io.gltf.document import open_gltf
from facert.io.gltf.scene import Scene, local_parts, placed, scene_of

log = logging.getLogger("facert")

_SQUARE = 1e-3  # how far a rotation may be from one


@dataclass(frozen=True, eq=False)
class Driven:
    """The controls of a character, and the nodes that some of them move."""

    controls: tuple[str, ...]
    """Its shapes, then the controls that are no shapes."""
    nodes: tuple[int, ...] = ()
    """Their numbers in the file."""
    motion: DrivenNodes | None = None
    """How they move, without vertices; None where there are no nodes."""


def driven_by(scene: Scene, shapes: tuple[str, ...], drivers: Drivers | None) -> Driven:
    """What drivers move in a scene of a character with these shapes.

    Raises `InputError` for a node that is not there, or there twice.
    """
    if drivers is None:
        return Driven(shapes)
    index = NameIndex.among(shapes, drivers.controls, "--drivers", halves=True, quiet=True)
    halves = {control: index.find_halves(control) for control in drivers.controls}
    controls = (*shapes, *(control for control, found in halves.items() if not found))
    columns = {control: halves[control] or [controls.index(control)] for control in halves}
    moves = [(one, _number(scene, one)) for one in drivers.entries if one.moves()]
    _log_properties([one for one in drivers.entries if one.property])
    nodes = tuple(node for node in _from_above(scene) if node in {there for _, there in moves})
    if not nodes:
        return Driven(controls)
    _warn_of_skins(scene, nodes)
    motion = _motion(scene, nodes, drivers, len(controls))
    for driver, node in moves:
        place = nodes.index(node)
        rotate = np.radians(driver.rotate) / len(columns[driver.control])
        translate = np.array(driver.translate) / len(columns[driver.control])
        motion.rotate[columns[driver.control], place] += rotate
        motion.translate[columns[driver.control], place] += translate / _scale(scene, node)
    return Driven(controls, nodes, motion)


def nodes_of(path: Path) -> tuple[str, ...]:
    """Names of the nodes of a file that drivers may move.

    Raises `InputError` when the file cannot be read safely.
    """
    with open_gltf(path) as document:
        return drivable(scene_of(document))


def drivable(scene: Scene) -> tuple[str, ...]:
    """Names of the nodes that move something: joints of skins, and what meshes hang on."""
    nodes = scene.document.root["nodes"]
    moving = _joints(scene)
    waiting = [i for i in scene.nodes if "mesh" in nodes[i] and "skin" not in nodes[i]]
    for node in waiting:
        while node >= 0 and node not in moving:
            moving.add(node)
            node = scene.parents.get(node, -1)
    names = (nodes[node].get("name") for node in _from_above(scene) if node in moving)
    return tuple(dict.fromkeys(name for name in names if isinstance(name, str) and name))


def _motion(scene: Scene, nodes: Sequence[int], drivers: Drivers, controls: int) -> DrivenNodes:
    """These nodes, which nothing moves yet."""
    described = scene.document.root["nodes"]
    return DrivenNodes(
        names=tuple(str(described[node]["name"]) for node in nodes),
        controls=drivers.controls,
        above=tuple(scene.above(scene.parents.get(node, -1), nodes) for node in nodes),
        frames=np.stack([_frame(scene, node) for node in nodes]),
        rotate=np.zeros((controls, len(nodes), 3)),
        translate=np.zeros((controls, len(nodes), 3)),
        shares=np.zeros((0, len(nodes))),
    )


def _frame(scene: Scene, node: int) -> FloatArray:
    """From a node's own axes, unscaled, to the scene's space, (4, 4)."""
    translation, turn, _ = local_parts(scene.document.root["nodes"][node])
    frame = _above(scene, node) @ placed(translation, turn, np.eye(3))
    name = printable(str(scene.document.root["nodes"][node]["name"]))
    if np.abs(turn.T @ turn - np.eye(3)).max() > _SQUARE or not abs(np.linalg.det(frame)) > 0:
        fix = "Apply its scale, and export again."
        raise InputError(f"node {name!r}", "a node that can turn", "a sheared or flat one", fix)
    return np.asarray(frame)


def _above(scene: Scene, node: int) -> FloatArray:
    parent = scene.parents.get(node)
    return np.eye(4) if parent is None else scene.worlds[parent]


def _scale(scene: Scene, node: int) -> float:
    """Metres of the scene in a unit of the node's translation."""
    return float(np.cbrt(abs(np.linalg.det(_above(scene, node)[:3, :3]))))


def _number(scene: Scene, driver: Driver) -> int:
    """The node of a driver's name, as it is or else in any spelling; of several the only joint."""
    nodes = scene.document.root["nodes"]
    joints = _joints(scene)
    names = {i: str(node["name"]) for i, node in enumerate(nodes) if node.get("name")}
    found = [i for i, name in names.items() if name == driver.node]
    found = [i for i in found if i in joints] if len(found) > 1 else found
    for among in (joints, names):
        some = [i for i in names if i in among]
        place = NameIndex([names[i] for i in some]).find(driver.node)
        found = found or ([] if place is None else [some[place]])
    if len(found) == 1:
        return found[0]
    field, near = f"[[{driver.control}]] node", nearest(driver.node, drivable(scene))
    if driver.node in names.values():
        there, fix = "several", "Give each a name of its own."
        raise InputError(field, f"one node {driver.node!r}", there, fix)
    hint = f"Did you mean {near!r}? " if near else ""
    fix = f"{hint}facert inspect lists the nodes of a .glb."
    raise InputError(field, f"the node {driver.node!r}", f"none among {len(names)}", fix)


def _joints(scene: Scene) -> set[int]:
    return {joint for skin in scene.document.root.get("skins", []) for joint in skin["joints"]}


def _from_above(scene: Scene) -> Iterator[int]:
    """All nodes, each after the one above it."""
    return iter(scene.worlds)


def _warn_of_skins(scene: Scene, nodes: Sequence[int]) -> None:
    described = [scene.document.root["nodes"][node] for node in nodes]
    idle = [str(one["name"]) for one in described if "skin" in one and not one.get("children")]
    if idle:
        log.warning("%s: the mesh follows its skeleton: drive a bone", printable(listed(idle, 6)))


def _log_properties(drivers: Sequence[Driver]) -> None:
    if drivers:
        names = printable(listed([f"{one.node}.{one.property}" for one in drivers], 6))
        log.info("properties are set by scripts alone (facert export-script): %s", names)
