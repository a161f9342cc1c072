"""glTF files of other programs' kinds, made by pygltflib."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib as gltf

FACE = np.float32([[-0.1, 0, 0], [0.1, 0, 0], [0, 0.2, 0]])
EYE = np.float32([[0, 0, 0], [0.02, 0, 0], [0, 0.02, 0]])
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Builder:
    """A document in the making, by pygltflib: one node with one mesh a call."""

    def __init__(self) -> None:
        self.document = gltf.GLTF2(scene=0, scenes=[gltf.Scene(nodes=[])])
        self.content = b""

    def view(self, array: np.ndarray, stride: int | None = None) -> int:
        content = array.tobytes()
        place = gltf.BufferView(
            buffer=0, byteOffset=len(self.content), byteLength=len(content), byteStride=stride
        )
        self.document.bufferViews.append(place)
        self.content += content + b"\0" * (-len(content) % 4)
        return len(self.document.bufferViews) - 1

    def accessor(self, array: np.ndarray, **others: Any) -> int:
        codes = {"f4": 5126, "u4": 5125, "u2": 5123, "u1": 5121, "i2": 5122, "i1": 5120}
        one = gltf.Accessor(
            componentType=codes[array.dtype.str[1:]],
            count=len(array),
            type=TYPES[1 if array.ndim == 1 else array.shape[1]],
            **({"bufferView": self.view(array)} | others),
        )
        self.document.accessors.append(one)
        return len(self.document.accessors) - 1

    def mesh(
        self,
        vertices: np.ndarray | int,
        targets: dict[str, np.ndarray | int],
        attributes: dict[str, int] | None = None,
        **node: Any,
    ) -> None:
        place = vertices if isinstance(vertices, int) else self.accessor(vertices)
        given = [one if isinstance(one, int) else self.accessor(one) for one in targets.values()]
        primitive = gltf.Primitive(
            attributes=gltf.Attributes(POSITION=place, **(attributes or {})),
            targets=[{"POSITION": one} for one in given],
        )
        self.document.meshes.append(
            gltf.Mesh(primitives=[primitive], extras={"targetNames": list(targets)})
        )
        self.document.nodes.append(gltf.Node(mesh=len(self.document.meshes) - 1, **node))
        self.document.scenes[0].nodes.append(len(self.document.nodes) - 1)

    def joint(self, **node: Any) -> int:
        """A node that is in no scene, unless another has it for a child."""
        self.document.nodes.append(gltf.Node(**node))
        return len(self.document.nodes) - 1

    def skin(self, joints: list[int], inverse: np.ndarray | None = None) -> int:
        """A skin of joints with inverse bind matrices (J, 4, 4)."""
        number = None
        if inverse is not None:
            columns = np.float32(inverse).transpose(0, 2, 1).reshape(-1, 16)
            number = self.accessor(columns)
        self.document.skins.append(gltf.Skin(joints=joints, inverseBindMatrices=number))
        return len(self.document.skins) - 1

    def animate(
        self, time: np.ndarray, output: np.ndarray, interpolation: str = "LINEAR", node: int = 0
    ) -> None:
        sampler = gltf.AnimationSampler(
            input=self.accessor(np.float32(time)),
            output=self.accessor(np.float32(output).ravel()),
            interpolation=interpolation,
        )
        target = gltf.AnimationChannelTarget(node=node, path="weights")
        channel = gltf.AnimationChannel(sampler=0, target=target)
        self.document.animations.append(gltf.Animation(samplers=[sampler], channels=[channel]))

    def save(self, path: Path) -> Path:
        self.document.buffers = [gltf.Buffer(byteLength=len(self.content))]
        self.document.set_binary_blob(self.content)
        self.document.save(str(path))
        return path


def glb(root: dict[str, Any], content: bytes) -> bytes:
    """A file of this JSON and these bytes."""
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    total = 28 + len(text) + len(content)
    return (
        struct.pack("<III", 0x46546C67, 2, total)
        + struct.pack("<II", len(text), 0x4E4F534A) + text
        + struct.pack("<II", len(content), 0x004E4942) + content
    )  # fmt: skip


def character(unused: int = 0) -> Builder:
    """A face that hangs by half on a jaw; an eye below a head; teeth, a body, a cornea, a stage."""
    builder = Builder()
    jaw = builder.joint(name="jaw", translation=[0, 0.05, 0])
    head = builder.joint(name="head", scale=[0.01] * 3, children=[jaw])
    builder.document.nodes[jaw].translation = [0, 5, 0]
    skin = builder.skin([head, jaw], np.stack([np.diag([100, 100, 100, 1.0]), _bound()]))
    joints, weights = (
        np.uint8([[0, 1, unused, unused]] * 3),
        np.float32([[0.5, 0.5, 0, 0], [1, 0, 0, 0]] * 2),
    )
    tied = {"JOINTS_0": builder.accessor(joints), "WEIGHTS_0": builder.accessor(weights[:3])}
    builder.mesh(FACE, {"jawOpen": np.float32([[0, -0.02, 0]] * 3)}, tied, skin=skin, name="face")
    both = np.float32([[0, 1, 0, 0]] * 3)
    tied = {"JOINTS_0": builder.accessor(joints), "WEIGHTS_0": builder.accessor(both)}
    builder.mesh(FACE * 0.5, {}, tied, skin=skin, name="teeth")
    builder.mesh(EYE, {}, name="eye", translation=[0.05, 0.1, 0.01])
    builder.mesh(EYE, {}, name="cornea", translation=[0.05, 0.1, 0.02])
    builder.mesh(FACE * 100, {}, name="stage", translation=[0, -9, 0])
    builder.document.materials = [
        gltf.Material(pbrMetallicRoughness=gltf.PbrMetallicRoughness(baseColorFactor=[1, 0, 0, 1])),
        gltf.Material(alphaMode="BLEND"),
    ]
    for mesh, material in ((2, 0), (3, 1)):
        builder.document.meshes[mesh].primitives[0].material = material
    return builder


def _bound() -> np.ndarray:
    matrix = np.diag([100, 100, 100, 1.0])
    matrix[1, 3] = -5
    return matrix
