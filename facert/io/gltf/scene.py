"""Where a glTF scene places vertices: by their node, or by the joints that a skin ties them to.

The rest pose of a skinned mesh is what the joints make of its vertices: each goes through the mean,
weighted, of the matrices ``world of the joint x inverse bind matrix``. The place of its own node
does not count. Exporters put units, axes and quantisation into any of these matrices.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.memory import FLOAT
from facert.io.gltf.document import Document

MAX_SETS = 8
"""Most sets of four joints a vertex."""


@dataclass(frozen=True, eq=False)
class Scene:
    """The nodes of a document's scene, and the transforms of all nodes.

    Attributes
    ----------
    document : Document
    nodes : tuple of int
        Those of the scene, each once, a node before its children.
    worlds : dict of arrays, shape (4, 4)
        From each node's space to the scene's, also of those outside of it, as joints may be.
    parents : dict of int
        The node above each that has one, by their numbers.
    """

    document: Document
    nodes: tuple[int, ...]
    worlds: dict[int, FloatArray]
    parents: dict[int, int]
    _matrices: dict[int, FloatArray] = field(default_factory=dict)  # of skins that were asked for
    _nearest: dict[tuple[int, ...], dict[int, int]] = field(default_factory=dict)

    def placement(self, node: int, attributes: dict[str, Any]) -> FloatArray:
        """Transforms of a mesh's vertices to the scene's space, (V, 4, 4); (1, 4, 4) of all alike.

        `attributes` are those of the mesh's primitive. Joints move it where the node has a skin.
        """
        skin = self.document.root["nodes"][node].get("skin")
        if skin is None or "JOINTS_0" not in attributes:
            return self.worlds[node][None]
        return self._blended(self._joint_matrices(skin), attributes)

    def _joint_matrices(self, skin: int) -> FloatArray:
        """World of the joint x inverse bind matrix of each joint, (J, 4, 4)."""
        if skin not in self._matrices:
            described = self.document.root["skins"][skin]
            self.document.memory.require(3 * 16 * FLOAT * len(described["joints"]), "skins")
            worlds = np.stack([self.worlds[joint] for joint in described["joints"]])
            if "inverseBindMatrices" in described:
                inverse = self.document.numbers(described["inverseBindMatrices"])[: len(worlds)]
                worlds = worlds @ inverse.reshape(len(worlds), 4, 4).transpose(0, 2, 1)
            self._matrices[skin] = worlds
        return self._matrices[skin]

    def shares(
        self, node: int, attributes: dict[str, Any], driven: Sequence[int]
    ) -> FloatArray | None:
        """How far a mesh's vertices follow each of some nodes, or what is below it, (V, N).

        None where all follow the nearest of them above the mesh alike, see `above`.
        """
        skin = self.document.root["nodes"][node].get("skin")
        if skin is None or "JOINTS_0" not in attributes or not driven:
            return None
        joint, share = self._ties(attributes)
        followed = [self.above(one, driven) for one in self.document.root["skins"][skin]["joints"]]
        self.document.memory.require(FLOAT * len(joint) * len(driven), "skins")
        found = np.zeros((len(joint), len(driven)))
        for number in range(len(driven)):
            found[:, number] = (share * (np.array(followed)[joint] == number)).sum(axis=1)
        return found

    def above(self, node: int, driven: Sequence[int]) -> int:
        """Position of the nearest of some nodes that is this one or above it; -1 for none."""
        return self._places(tuple(driven)).get(node, -1)

    def _places(self, driven: tuple[int, ...]) -> dict[int, int]:
        """What `above` is for every node; each comes after its parent, so that one walk does."""
        if driven not in self._nearest:
            places = {one: place for place, one in enumerate(driven)}
            found: dict[int, int] = {}
            for node in self.worlds if driven else ():
                inherited = found.get(self.parents.get(node, -1), -1)
                found[node] = places.get(node, inherited)
            self._nearest[driven] = found
        return self._nearest[driven]

    def _blended(self, matrices: FloatArray, attributes: dict[str, Any]) -> FloatArray:
        """Weighted means of joints' matrices, (V, 4, 4); all of the first joint without weights."""
        joint, share = self._ties(attributes)
        blended = np.zeros((len(joint), 4, 4))
        for column in range(joint.shape[1]):
            used = share[:, column] != 0
            blended[used] += share[used, column, None, None] * matrices[joint[used, column]]
        return blended

    def _ties(self, attributes: dict[str, Any]) -> tuple[IntArray, FloatArray]:
        """The joints of each vertex, and how far it follows them, (V, n) each; the shares add to 1.

        Where a share is 0, the joint is the first, as the file may have any number there.
        """
        joints, weights = [], []
        for number in range(MAX_SETS):
            if f"JOINTS_{number}" not in attributes:
                break
            joints.append(self.document.integers(attributes[f"JOINTS_{number}"]))
            weights.append(self.document.numbers(attributes[f"WEIGHTS_{number}"]))
        joint, weight = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
        self.document.memory.require(16 * FLOAT * len(joint), "skins")  # a matrix each
        if not np.isfinite(weight).all():
            raise ValueError("NaN or infinity for the weight of a joint")
        weight = np.maximum(weight, 0.0)  # below 0 by rounding
        weight[weight.sum(axis=1) == 0, 0] = 1.0
        share = weight / weight.sum(axis=1, keepdims=True)
        return np.where(share != 0, joint, 0), share


def scene_of(document: Document) -> Scene:
    """The scene that the document shows first."""
    nodes = document.root["nodes"]
    below = {child for node in nodes for child in node.get("children", [])}
    tops = [index for index in range(len(nodes)) if index not in below]
    scenes = document.root.get("scenes") or [{"nodes": tops}]
    found = _Walk(nodes, _transforms(nodes))
    shown = tuple(found.below(scenes[document.root.get("scene", 0)]["nodes"]))
    for starts in (tops, range(len(nodes))):  # the latter for circles, which nothing leads to
        list(found.below(starts))
    return Scene(document, shown, found.worlds, found.parents)


def transformed(vertices: FloatArray, placement: FloatArray) -> FloatArray:
    """Vertices (V, 3) in the scene's space; see `Scene.placement`."""
    return np.asarray(displaced(vertices[None], placement)[0] + placement[:, :3, 3])


def displaced(targets: FloatArray, placement: FloatArray) -> FloatArray:
    """Displacements (K, V, 3) of vertices, in the scene's space; see `Scene.placement`."""
    if len(placement) == 1:
        return np.asarray(targets @ placement[0, :3, :3].T)
    return np.asarray(np.einsum("vij,kvj->kvi", placement[:, :3, :3], targets))


def mirrored(placement: FloatArray) -> bool:
    """Whether it turns most triangles inside out; see `Scene.placement`."""
    return bool(np.median(np.linalg.det(placement[:, :3, :3])) < 0)


@dataclass(frozen=True, eq=False)
class _Walk:
    """A walk over nodes, each once, which finds their transforms and parents."""

    nodes: Any
    own: FloatArray
    """Transforms from each node's space to that of its parent, (N, 4, 4)."""
    worlds: dict[int, FloatArray] = field(default_factory=dict)
    parents: dict[int, int] = field(default_factory=dict)

    def below(self, starts: Any) -> Iterator[int]:
        """Iterate over the nodes below some, each that was not met before, before its children."""
        waiting = [(index, np.eye(4), -1) for index in reversed(starts)]
        while waiting:
            index, world, parent = waiting.pop()
            if index in self.worlds:
                continue
            if parent >= 0:
                self.parents[index] = parent  # the way that was gone: there are no circles in it
            self.worlds[index] = world @ self.own[index]
            yield index
            children = reversed(self.nodes[index].get("children", []))
            waiting += [(child, self.worlds[index], index) for child in children]


def _transforms(nodes: Sequence[dict[str, Any]]) -> FloatArray:
    """Transforms from each node's space to that of its parent, (N, 4, 4)."""
    from scipy.spatial.transform import Rotation  # takes its time

    found = np.tile(np.eye(4), (len(nodes), 1, 1))
    if not len(nodes):
        return found
    turns = Rotation.from_quat([node.get("rotation", (0, 0, 0, 1)) for node in nodes]).as_matrix()
    scales = np.array([node.get("scale", (1, 1, 1)) for node in nodes], dtype=np.float64)
    found[:, :3, :3] = turns * scales[:, None, :]
    found[:, :3, 3] = [node.get("translation", (0, 0, 0)) for node in nodes]
    for index, node in enumerate(nodes):
        if "matrix" in node:
            found[index, :3] = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T[:3]
    return found


def local_parts(node: dict[str, Any]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A node's own translation (3,), rotation matrix (3, 3) and what is within, (3, 3): its scale.

    Of a node with a matrix the rotation is that of its columns, and the rest, shear as well, is
    within.
    """
    from scipy.spatial.transform import Rotation  # takes its time

    if "matrix" in node:
        matrix = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        scale[0] *= -1.0 if np.linalg.det(matrix[:3, :3]) < 0 else 1.0
        whole = scale.all()
        turn = matrix[:3, :3] / scale if whole else np.eye(3)
        return matrix[:3, 3], turn, np.diag(scale) if whole else matrix[:3, :3]
    turn = Rotation.from_quat(node["rotation"]).as_matrix() if "rotation" in node else np.eye(3)
    scale = np.array(node.get("scale", [1.0] * 3), dtype=np.float64)
    return np.array(node.get("translation", [0.0] * 3), dtype=np.float64), turn, np.diag(scale)


def placed(translation: FloatArray, turn: FloatArray, within: FloatArray) -> FloatArray:
    """The transform (4, 4) of these parts, see `local_parts`."""
    local = np.eye(4)
    local[:3, :3], local[:3, 3] = turn @ within, translation
    return local
