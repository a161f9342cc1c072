"""Keys the attributes of a Maya node with curves that facert wrote (.json or .csv).

In Maya's script editor (Python): run this once, then, with a blendShape node or a control,

    key_attributes("/shots/010/curves.json", "face_blendShape")

A curve whose name is as ``node.attribute`` goes to that node, one of DRIVERS to the nodes there.
Keys are set by time: at another frame rate than the recording's the motion is as fast. Poses that
you keyed, at frames of a recording, are written as facert convert --poses reads them by

    export_poses("/shots/010/poses.csv", "face_blendShape")
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

import maya.cmds as cmds

from facert.io.importers.motions import Place, Sums, added, controls_at, motions_of
from facert.io.importers.rotations import (
    euler_of,
    multiplied,
    of_euler,
    of_vector,
    transposed,
    turned,
    vector_of,
)
from facert.io.importers.shared import (
    Curves,
    Pose,
    ScriptError,
    find,
    keys,
    meant,
    plural,
    read_curves,
    write_poses,
)

START = 0.0  # seconds of the first key
# As in drivers.toml; facert export-script --drivers puts it here.
DRIVERS: dict[str, Any] = {}
REST = "facertRest"  # of a node that drivers move: its rotation and translation at rest

_RATES = {"game": 15, "film": 24, "pal": 25, "ntsc": 30, "show": 48, "palf": 50, "ntscf": 60}
_METRE = {"mm": 1000.0, "cm": 100.0, "m": 1.0, "km": 0.001, "in": 39.37007874, "ft": 3.280839895}


def key_attributes(path: str, node: str = "") -> None:
    """Key the attributes of a node; warn of the curves that it has no attribute for."""
    try:
        curves = read_curves(path)
        there, missing = _attributes(node), []
        driven = {c: name for c in motions_of(DRIVERS) if (name := find(c, curves.values))}
        for control in curves.values:
            own, _, name = control.rpartition(".")
            found = find(name, _attributes(own) if own else there)
            if found is not None:
                _key(
                    own or node,
                    found,
                    [(key.time, key.value) for key in keys(curves, control)],
                    curves,
                )
            elif control not in driven.values():
                missing.append(meant(control, there))
        _key_nodes(curves, driven)
    except ScriptError as error:
        cmds.warning(f"facert: {error}")
        return
    if missing:
        cmds.warning(f"no attribute for {', '.join(missing)}")
    print(f"{len(curves.time)} frames at {curves.fps:g} frames/s")


def export_poses(
    path: str, node: str, frames: Iterable[float] = (), fps: float | None = None
) -> None:
    """Write the poses of keyed frames, or of these ones, for ``facert convert --poses``.

    `frames` are those of Maya's timeline, whose second START is the recording's frame 0; `fps` is
    the recording's rate, else the scene's.
    """
    try:
        names, rate = _posed_attributes(node), _scene_rate()
        times = sorted(set(frames) or _keyed(node, names))
        if not times:
            raise ScriptError("no frame is keyed: key the poses first, or give frames=[...]")
        poses = {}
        for time in times:
            number = round((time / rate - START) * (fps or rate))
            values = {name: float(cmds.getAttr(f"{node}.{name}", time=time)) for name in names}
            poses[number] = Pose(
                number, number / (fps or rate), {**_driven_at(time, values), **values}
            )
        kept = [poses[number] for number in sorted(poses) if number >= 0]
        write_poses(path, kept, fps or rate)
    except ScriptError as error:
        cmds.warning(f"facert: {error}")
        return
    print(f"{plural(len(kept), 'pose')} of frames {', '.join(str(pose.frame) for pose in kept)}")


def _attributes(node: str) -> list[str]:
    """Keyable attributes of a node: a blendShape's weights by the names of its targets."""
    if not node or not cmds.objExists(node):
        return []
    driven = {place.name for place in _places() if place.node == node and place.name}
    there = cmds.listAttr(node, keyable=True, multi=True) or []
    return [name for name in there if name not in driven]


def _places() -> set[Place]:
    """All that drivers move."""
    return {motion.place for found in motions_of(DRIVERS).values() for motion in found}


def _posed_attributes(node: str) -> list[str]:
    """The attributes of a pose: all targets of a blendShape; of another node what is keyed."""
    if not cmds.objExists(node):
        raise ScriptError(f"no node {node!r}")
    names = _attributes(node)
    if cmds.nodeType(node) == "blendShape":
        return [name for name in names if name != "envelope"]
    return [name for name in names if cmds.keyframe(node, attribute=name, query=True)]


def _keyed(node: str, names: Sequence[str]) -> set[float]:
    pairs = [(node, name) for name in names]
    pairs += [(p.node, p.name or f"{p.kind}{axis}") for p in _places() for axis in "XYZ"]
    return {
        time
        for owner, name in pairs
        if cmds.objExists(owner)
        for time in cmds.keyframe(owner, attribute=name, query=True, timeChange=True) or ()
    }


def _key(node: str, attribute: str, points: Sequence[tuple[float, float]], curves: Curves) -> None:
    for time, value in points:
        cmds.setKeyframe(
            node,
            attribute=attribute,
            time=f"{START + time - curves.time[0]:.6f}sec",
            value=value,
            inTangentType="linear",
            outTangentType="linear",
        )


def _key_nodes(curves: Curves, driven: dict[str, str]) -> None:
    """Key what drivers move, by all controls together."""
    motions = motions_of(DRIVERS)
    missing = {m.place.node for c in driven for m in motions[c] if not cmds.objExists(m.place.node)}
    if missing:
        cmds.warning(f"no node for drivers: {', '.join(sorted(missing))}")
    tracks: dict[tuple[str, str], list[tuple[float, float]]] = {}
    values = dict.fromkeys(motions, 0.0)
    for row, time in enumerate(curves.time):
        for control, name in driven.items():
            value = curves.values[name][row]
            values[control] = values[control] if value is None else value
        for place, amount in added(motions, values).items():
            moved = any(m.place == place for c in driven for m in motions[c])
            if moved and place.node not in missing:
                for attribute, number in _numbers(place, amount).items():
                    tracks.setdefault((place.node, attribute), []).append((time, number))
    for (node, attribute), points in tracks.items():
        _key(node, attribute, points, curves)


def _numbers(place: Place, amount: Sequence[float]) -> dict[str, float]:
    """The values of the attributes of a place that is moved from its rest."""
    if place.kind == "property":
        return {place.name: amount[0]}
    orient, rest, shift = _rest(place.node)
    if place.kind == "rotate":
        found = euler_of(multiplied(rest, of_vector(amount)))
    else:
        moved = turned(multiplied(orient, rest), amount)
        found = [a + b * _metre() for a, b in zip(shift, moved)]
    return {f"{place.kind}{axis}": value for axis, value in zip("XYZ", found)}


def _driven_at(time: float, known: dict[str, float]) -> dict[str, float]:
    """The controls of drivers by where their nodes are."""
    motions = motions_of(DRIVERS)
    measured: Sums = {}
    for place in [place for place in _places() if cmds.objExists(place.node)]:
        if place.kind == "property":
            measured[place] = [float(cmds.getAttr(f"{place.node}.{place.name}", time=time))]
            continue
        orient, rest, shift = _rest(place.node)
        now = [cmds.getAttr(f"{place.node}.{place.kind}{axis}", time=time) for axis in "XYZ"]
        if place.kind == "rotate":
            measured[place] = vector_of(multiplied(transposed(rest), of_euler(now)))
        else:
            moved = [(a - b) / _metre() for a, b in zip(now, shift)]
            measured[place] = turned(transposed(multiplied(orient, rest)), moved)
    return controls_at(motions, measured, {c: known[c] for c in motions if c in known})


def _rest(node: str) -> tuple[Any, Any, list[float]]:
    """The orientation of a joint, and a node's rotation and translation at rest, which it keeps."""
    if cmds.getAttr(f"{node}.rotateOrder") != 0:
        raise ScriptError(f"{node}: its rotate order has to be xyz to be driven")
    if not cmds.attributeQuery(REST, node=node, exists=True):
        found = [*cmds.getAttr(f"{node}.rotate")[0], *cmds.getAttr(f"{node}.translate")[0]]
        cmds.addAttr(node, longName=REST, dataType="string")
        cmds.setAttr(f"{node}.{REST}", json.dumps(found), type="string")
    kept = json.loads(cmds.getAttr(f"{node}.{REST}"))
    joint = cmds.attributeQuery("jointOrient", node=node, exists=True)
    orient = cmds.getAttr(f"{node}.jointOrient")[0] if joint else (0.0, 0.0, 0.0)
    return of_euler(orient), of_euler(kept[:3]), kept[3:]


def _metre() -> float:
    return _METRE[cmds.currentUnit(query=True, linear=True)]


def _scene_rate() -> float:
    """Frames a second of the scene, such as ``film`` or ``29.97fps``."""
    unit = cmds.currentUnit(query=True, time=True)
    rate = float(_RATES[unit]) if unit in _RATES else float(unit[: -len("fps")])
    whole = math.ceil(rate)
    return whole / 1.001 if 0 < whole - rate < 0.1 else rate
