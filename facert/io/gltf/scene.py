"""Where a glTF scene places vertices: by their node, or by the joints that a skin ties them to.

The rest pose of a skinned mesh is what the joints make of its vertices: each goes through the mean,
weighted, of the matrices ``world of the joint x inverse bind matrix``. The place of its own node
does not count. Exporters put units, axes and quantisation into any of these matrices.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.io.gltf.document import MAX_VALUES, Document

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
    """

    document: Document
    nodes: tuple[int, ...]
    worlds: dict[int, FloatArray]

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
        described = self.document.root["skins"][skin]
        worlds = np.stack([self.worlds[joint] for joint in described["joints"]])
        if "inverseBindMatrices" not in described:
            return worlds
        inverse = self.document.numbers(described["inverseBindMatrices"])[: len(worlds)]
        return np.asarray(worlds @ inverse.reshape(len(worlds), 4, 4).transpose(0, 2, 1))

    def _blended(self, matrices: FloatArray, attributes: dict[str, Any]) -> FloatArray:
        """Weighted means of joints' matrices, (V, 4, 4); all of the first joint without weights."""
        joints, weights = [], []
        for number in range(MAX_SETS):
            if f"JOINTS_{number}" not in attributes:
                break
            joints.append(self.document.integers(attributes[f"JOINTS_{number}"]))
            weights.append(self.document.numbers(attributes[f"WEIGHTS_{number}"]))
        joint, weight = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
        if 16 * len(joint) > MAX_VALUES:
            raise ValueError(f"{len(joint)} vertices that follow joints")
        if not np.isfinite(weight).all():
            raise ValueError("NaN or infinity for the weight of a joint")
        weight = np.maximum(weight, 0.0)  # below 0 by rounding
        weight[weight.sum(axis=1) == 0, 0] = 1.0
        share = weight / weight.sum(axis=1, keepdims=True)
        blended = np.zeros((len(joint), 4, 4))
        for column in range(joint.shape[1]):
            used = share[:, column] != 0  # a joint without weight may be any number
            blended[used] += share[used, column, None, None] * matrices[joint[used, column]]
        return blended


def scene_of(document: Document) -> Scene:
    """The scene that the document shows first."""
    nodes = document.root["nodes"]
    below = {child for node in nodes for child in node.get("children", [])}
    tops = [index for index in range(len(nodes)) if index not in below]
    scenes = document.root.get("scenes") or [{"nodes": tops}]
    worlds: dict[int, FloatArray] = {}
    shown = tuple(_walk(nodes, scenes[document.root.get("scene", 0)]["nodes"], worlds))
    for starts in (tops, range(len(nodes))):  # the latter for circles, which nothing leads to
        list(_walk(nodes, starts, worlds))
    return Scene(document, shown, worlds)


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


def _walk(nodes: Any, starts: Any, worlds: dict[int, FloatArray]) -> Iterator[int]:
    """Iterate over the nodes below some, each node once, and find their transforms."""
    waiting = [(index, np.eye(4)) for index in reversed(starts)]
    while waiting:
        index, above = waiting.pop()
        if index in worlds:
            continue
        worlds[index] = above @ _local(nodes[index])
        yield index
        children = reversed(nodes[index].get("children", []))
        waiting += [(child, worlds[index]) for child in children]


def _local(node: dict[str, Any]) -> FloatArray:
    """A node's own transform, (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    from scipy.spatial.transform import Rotation  # takes its time

    local = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", [0.0, 0.0, 0.0, 1.0])).as_matrix()
    local[:3, :3] = turn * np.array(node.get("scale", [1.0] * 3), dtype=np.float64)
    local[:3, 3] = node.get("translation", [0.0] * 3)
    return local
