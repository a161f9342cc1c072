"""A character in a glTF file that a take moves: the file carried through, and one animation more.

Every node whose mesh has some of the controls gets the weights of its targets, and every driven
node its rotation or translation. Targets that the take does not drive keep the weights with which
the file shows them. A take of one frame poses the character: weights and nodes are set.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import BoolArray, FloatArray
from facert.data.drivers import Drivers, require_used
from facert.data.names import shape_drivers
from facert.data.text import listed, plural, printable
from facert.errors import InputError
from facert.io.gltf.carried import CarriedFile
from facert.io.gltf.document import Document
from facert.io.gltf.driven import Driven, driven_by
from facert.io.gltf.names import target_names
from facert.io.gltf.rig import EXPRESSIONS, expressions_by_name
from facert.io.gltf.scene import Scene, local_parts, scene_of
from facert.io.gltf.vrm import material_expressions, target_weights
from facert.io.guarded import parsing

log = logging.getLogger("facert")

_LISTED = 12  # names in a line
_Channels = dict[tuple[int, str], FloatArray]
"""Values (T, width) by node and what of it they are: weights, rotation or translation."""


@dataclass(frozen=True, eq=False)
class _Targets:
    """The morph targets of a node's mesh."""

    node: int
    default: FloatArray  # the weights that the file shows, (n,)
    binds: FloatArray  # how far each control sets each target, (K, n)


class Character:
    """A character in a glTF file, and what moves it.

    Parameters
    ----------
    path : Path
    shapes : str, optional
        "expressions" for those of a VRM avatar as controls, else its morph targets.
    drivers : Drivers, optional
        Of controls that are no shapes.

    Raises
    ------
    InputError
        When the file cannot be read safely, has nothing that a control could move, or lacks a
        driven node.
    """

    def __init__(
        self, path: Path, shapes: str | None = None, drivers: Drivers | None = None
    ) -> None:
        self._file, self._name, self._drivers = CarriedFile(path), path.name, drivers
        with parsing("file", "valid glTF 2.0"):
            document = Document(self._file.root, [])
            self._scene: Scene = scene_of(document)
            names, binds = _binds(document, shapes)
            self._driven: Driven = driven_by(self._scene, names, drivers)
            idle = len(self._driven.controls) - len(names)
            self._targets = [
                _Targets(
                    node, _default(document, node, matrix), np.pad(matrix, ((0, idle), (0, 0)))
                )
                for node, matrix in binds.items()
            ]
        if not self._driven.controls:
            fix = "Export the mesh with its shape keys, or map controls to bones with --drivers."
            raise InputError("meshes", "morph targets", "none", fix)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its shapes, and of the controls that drive nodes."""
        return self._driven.controls

    def write(
        self,
        controls: Sequence[str],
        params: FloatArray,
        time: FloatArray,
        path: Path,
        overwrite: bool = False,
    ) -> str:
        """Write the character in motion as GLB; return what was written.

        Parameters
        ----------
        controls : sequence of str, length P
            Found among the character's by `facert.data.names.shape_drivers`.
        params : array, shape (T, P)
            Frames with NaN, which have no pose, are left out.
        time : array, shape (T,)
            Seconds; the animation begins at 0.
        path, overwrite
            As of every writer.

        Raises
        ------
        InputError
            When the character lacks a control, or no frame has a pose.
        OutputExistsError
            When `path` exists and `overwrite` is not set.
        """
        posed = ~np.isnan(params).any(axis=1)
        if not posed.any():
            raise InputError("/target/params", "a pose", "none", "Retarget the take first.")
        if self._drivers is not None:
            require_used(self._drivers.controls, controls)
        drivers = shape_drivers(controls, self.names)
        channels = self._channels(params[posed] @ drivers, np.asarray(drivers.any(axis=0)))
        with parsing("file", "valid glTF 2.0"):
            if len(time[posed]) > 1:
                self._replace_others(channels)
                self._animate(channels, time[posed] - time[posed][0], path.stem)
            else:
                self._pose(channels)
        self._file.write(path, overwrite)
        self._log(controls, params[posed], channels)
        frames, count = plural(int(posed.sum()), "frame"), plural(len(controls), "control")
        return f"{frames} of {count}, all else as in {self._name}"

    def _channels(self, settings: FloatArray, moved: BoolArray) -> _Channels:
        """What settings (T, K) of the controls make of targets and nodes."""
        found: _Channels = {}
        for one in self._targets:
            driven = one.binds[moved].any(axis=0)
            if driven.any():
                weights = np.where(driven, settings @ one.binds, one.default)
                found[one.node, "weights"] = weights
        motion = self._driven.motion
        if motion is None:
            return found
        rotate, translate = motion.vectors(settings)
        for place, node in enumerate(self._driven.nodes):
            at, turn, _ = local_parts(self._scene.document.root["nodes"][node])
            if motion.rotate[:, place].any():
                found[node, "rotation"] = _quaternions(turn, rotate[:, place])
            if motion.translate[:, place].any():
                found[node, "translation"] = at + translate[:, place] @ turn.T
        return found

    def _animate(self, channels: _Channels, time: FloatArray, name: str) -> None:
        """Put the animation before all others: programs show the first."""
        buffer = self._file.buffer
        moments = buffer.keys(time)
        samplers: list[dict[str, Any]] = []
        targets: list[dict[str, Any]] = []
        for (node, kind), values in channels.items():
            plain = values.ravel() if kind == "weights" else values
            sampler = {"input": moments, "output": buffer.keys(plain), "interpolation": "LINEAR"}
            targets.append({"sampler": len(samplers), "target": {"node": node, "path": kind}})
            samplers.append(sampler)
            if kind != "weights":
                _with_parts(self._file.root["nodes"][node])
        animation = {"name": name, "samplers": samplers, "channels": targets}
        self._file.root["animations"] = [animation, *self._file.root.get("animations", [])]

    def _pose(self, channels: _Channels) -> None:
        """Let the file show its only frame."""
        for (node, kind), values in channels.items():
            described = self._file.root["nodes"][node]
            if kind != "weights":
                _with_parts(described)
            described[kind] = values[0].tolist()

    def _replace_others(self, channels: _Channels) -> None:
        """Take from other animations what the new one moves; log what became of each."""
        kept = []
        for number, one in enumerate(self._file.root.get("animations", []), start=1):
            name = printable(str(one.get("name", f"animation {number}")))
            left = [channel for channel in one["channels"] if _target_of(channel) not in channels]
            if not left:
                log.info("animation %s moved the same: replaced", name)
                continue
            less = ", without what the new one moves" if len(left) < len(one["channels"]) else ""
            log.info("animation %s is kept%s", name, less)
            kept.append(one | {"channels": left})
        self._file.root["animations"] = kept

    def _log(self, controls: Sequence[str], params: FloatArray, channels: _Channels) -> None:
        root, parts = self._scene.document.root, []
        for word, kinds in (("shapes of", ("weights",)), ("nodes", ("rotation", "translation"))):
            names = dict.fromkeys(_label(root, node) for node, kind in channels if kind in kinds)
            parts += [f"{word} {listed(list(names), _LISTED)}"] if names else []
        log.info("animated: %s", "; ".join(parts) or "nothing")
        still = [name for name, one in zip(controls, params.T, strict=True) if not one.any()]
        if still:
            count = plural(len(still), "control")
            log.info("%s at 0 throughout: %s", count, listed(still, _LISTED))


def _binds(document: Document, shapes: str | None) -> tuple[tuple[str, ...], dict[int, FloatArray]]:
    """The shapes of a character, and how far they set the targets of each node's mesh, (K, n)."""
    of_meshes = target_names(document)
    nodes = enumerate(document.root["nodes"])
    meshes = {i: node["mesh"] for i, node in nodes if node.get("mesh") in of_meshes}
    expressions = expressions_by_name(document, shapes)
    if shapes == EXPRESSIONS:
        _log_materials(document)
        return tuple(expressions), {
            node: target_weights(expressions, mesh, len(of_meshes[mesh]))
            for node, mesh in meshes.items()
        }
    names = tuple(dict.fromkeys(name for mesh in meshes.values() for name in of_meshes[mesh]))
    return names, {
        node: np.array([[name == one for one in of_meshes[mesh]] for name in names], dtype=float)
        for node, mesh in meshes.items()
    }


def _default(document: Document, node: int, binds: FloatArray) -> FloatArray:
    """The weights with which the file shows a node's mesh, (n,)."""
    described = document.root["nodes"][node]
    mesh = document.root["meshes"][described["mesh"]]
    weights = described.get("weights", mesh.get("weights", []))[: binds.shape[1]]
    return np.pad(np.array(weights, dtype=np.float64), (0, binds.shape[1] - len(weights)))


def _log_materials(document: Document) -> None:
    names = material_expressions(document.root)
    if names:
        log.info("what these expressions do to materials is left aside: %s", listed(names))


def _quaternions(turn: FloatArray, vectors: FloatArray) -> FloatArray:
    """A rest rotation (3, 3) followed by rotations about its own axes, as x, y, z, w (T, 4).

    Of the two signs of each, the one nearer to the frame before.
    """
    from scipy.spatial.transform import Rotation  # takes its time

    found = (Rotation.from_matrix(turn) * Rotation.from_rotvec(vectors)).as_quat()
    flips = np.where(np.sum(found[1:] * found[:-1], axis=1) < 0, -1.0, 1.0)
    found[1:] *= np.cumprod(flips)[:, None]
    return np.asarray(found)


def _with_parts(node: dict[str, Any]) -> None:
    """Give a node translation, rotation and scale for its matrix, as only these can be animated."""
    if "matrix" in node:
        translation, turn, within = local_parts(node)
        del node["matrix"]
        node["translation"] = translation.tolist()
        node["rotation"] = _quaternions(turn, np.zeros((1, 3)))[0].tolist()
        node["scale"] = np.diag(within).tolist()


def _target_of(channel: dict[str, Any]) -> tuple[Any, Any]:
    return channel["target"].get("node"), channel["target"]["path"]


def _label(root: dict[str, Any], number: int) -> str:
    node = root["nodes"][number]
    mesh = root["meshes"][node["mesh"]] if "mesh" in node else {}
    return str(node.get("name") or mesh.get("name") or f"node {number}")
